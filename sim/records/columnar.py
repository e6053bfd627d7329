"""Parquet and Feather by pyarrow, MAT by scipy, CSV packed by gzip or zstd; fast CSV by pyarrow.

Units stand in brackets behind the names of the columns; in a MAT file, whose names cannot hold
them, in a struct ``units``.
"""

from __future__ import annotations

import dataclasses
import gzip
import io
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError
from boresight.model.tools.extras import optional
from boresight.sim.records.archive import heads_of, record_of_arrays
from boresight.sim.records.record import Record, shifted

__all__ = [
    "fast_rows",
    "fast_table",
    "format_feather",
    "format_mat",
    "packer_gzip",
    "packer_zstd",
    "pieces_of_parquet",
    "parse_feather",
    "parse_mat",
    "parquet_of",
    "parse_parquet",
    "unpack_gzip",
    "unpack_zstd",
    "write_parquet",
]


def _arrow(name: str = "") -> ModuleType:
    return optional(f"pyarrow.{name}" if name else "pyarrow")


def _damaged(path: Path, wanted: str, error: Exception) -> InputError:
    lines = str(error).strip().splitlines()
    return InputError.at(
        str(path),
        wanted=wanted,
        found=f"a file that cannot be read as one ({lines[0][:120] if lines else 'damaged'})",
        fix="write it again, or give it the suffix of what it holds",
    )


def parse_parquet(path: Path, content: bytes) -> Record:
    """Parse a Parquet file; raises InputError as `archive.parse_npz`."""
    parquet = _arrow("parquet")
    return _record(path, "a Parquet file", lambda b: parquet.ParquetFile(b).read(), content)


def parse_feather(path: Path, content: bytes) -> Record:
    """Parse a Feather file (version 2, or 1); raises InputError as `archive.parse_npz`."""
    read = _arrow("feather").read_table
    return _record(path, "a Feather file", read, content)


def _record(path: Path, wanted: str, read: Any, content: bytes) -> Record:
    try:
        table = read(_arrow().BufferReader(content))
        table.validate(full=True)
        arrays = [column.to_numpy() for column in table.columns]
    except Exception as error:  # pyarrow lets out whatever its readers of damaged bytes meet
        raise _damaged(path, wanted, error) from None
    return record_of_arrays(path, list(zip(table.column_names, arrays, strict=True)))


def pieces_of_parquet(path: Path, file: BinaryIO) -> Iterator[Record]:
    """Parse a Parquet file in pieces; raises InputError as `parse_parquet`."""
    parquet, rows = _arrow("parquet"), 0
    try:
        with _pool():
            # It would hold its read-ahead buffers to the end of the file.
            table = parquet.ParquetFile(file, pre_buffer=False)
        for batch in table.iter_batches(batch_size=1 << 16):
            names, arrays = batch.schema.names, [c.to_numpy(False) for c in batch.columns]
            record = record_of_arrays(path, list(zip(names, arrays, strict=True)))
            yield dataclasses.replace(record, place=shifted(record.place, rows))
            rows += len(record)
        if not rows:  # which is refused
            record_of_arrays(path, [(n, np.zeros(0)) for n in table.schema_arrow.names])
    except (InputError, GeneratorExit):
        raise
    except Exception as error:
        raise _damaged(path, "a Parquet file", error) from None


@contextmanager
def _pool() -> Iterator[Any]:
    """Memory of the C library, for arrow's readers that are made meanwhile.

    Its own, by default, gives memory back between the pieces of a log and takes it again page by
    page: an eighth of the time of a run.
    """
    arrow = _arrow()
    previous = arrow.default_memory_pool()
    arrow.set_memory_pool(arrow.system_memory_pool())
    try:
        yield arrow.system_memory_pool()
    finally:
        arrow.set_memory_pool(previous)


def write_parquet(file: BinaryIO, blocks: Iterable[Record]) -> None:
    """Write blocks that follow each other: a column for each, compressed by LZ4.

    Bytes of like weight stand together (BYTE_STREAM_SPLIT): measured values repeat too seldom for
    a dictionary, which takes four times as long and twice the space.
    """
    parquet, writer = _arrow("parquet"), None
    for block in map(_table, blocks):
        if writer is None:
            with _pool() as pool:
                writer = parquet.ParquetWriter(
                    file,
                    block.schema,
                    compression="lz4",
                    use_dictionary=False,
                    use_byte_stream_split=True,
                    memory_pool=pool,
                )
        writer.write_table(block)
    if writer is not None:
        writer.close()


def parquet_of(columns: Mapping[str, Sequence[Any]]) -> bytes:
    """Columns of any kind as a Parquet file.

    Raises
    ------
    ToolMissing
        pyarrow is not installed.
    """
    buffer = io.BytesIO()
    _arrow("parquet").write_table(_arrow().table(dict(columns)), buffer)
    return buffer.getvalue()


def format_feather(record: Record) -> bytes:
    """Pack a record: one column for each, compressed by LZ4."""
    buffer = io.BytesIO()
    _arrow("feather").write_feather(_table(record), buffer, compression="lz4")
    return buffer.getvalue()


def _table(record: Record) -> Any:
    arrow = _arrow()
    return arrow.table({n: arrow.array(values) for n, values in heads_of(record).items()})


def parse_mat(path: Path, content: bytes) -> Record:
    """Parse a MAT file up to version 7: a vector for each column, or the nine-axis form.

    Raises
    ------
    InputError
        The content is not such a file; the message names array and index, from 0.
    """
    load = optional("scipy.io").loadmat
    try:
        contents = load(io.BytesIO(content))
        raw = contents.pop("units", None)
        units = {n: str(raw[n].item().item()) for n in raw.dtype.names} if _is_struct(raw) else {}
        arrays = [
            (f"{n}[{units[n]}]" if n in units else n, _vector(n, array))
            for n, array in contents.items()
            if not n.startswith("__")
        ]
    except NotImplementedError:
        raise InputError.at(
            str(path),
            wanted="a MAT file up to version 7",
            found="one of version 7.3, which is HDF5",
            fix="save it with -v7",
        ) from None
    except Exception as error:  # scipy too
        raise _damaged(path, "a MAT file up to version 7", error) from None
    return record_of_arrays(path, arrays)


def _is_struct(struct: Any) -> bool:
    return struct is not None and struct.dtype.names is not None


def _vector(name: str, value: Any) -> npt.NDArray[Any]:
    """MATLAB has matrices only: a row or a column is a vector, and the rate a number."""
    array: npt.NDArray[Any] = np.asarray(value)
    if name == "fs" and array.size == 1:
        return array.reshape(())
    return array.ravel() if array.ndim == 2 and 1 in array.shape else array


def format_mat(record: Record) -> bytes:
    """Pack a record: a column vector for each column, and the struct ``units``."""
    arrays: dict[str, Any] = {n: c.values[:, None] for n, c in record.columns.items()}
    if units := {n: c.unit for n, c in record.columns.items() if c.unit is not None}:
        arrays["units"] = units
    buffer = io.BytesIO()
    optional("scipy.io").savemat(buffer, arrays, long_field_names=True, do_compression=True)
    content = buffer.getvalue()
    return b"MATLAB 5.0 MAT-file".ljust(116) + content[116:]  # scipy writes the time there


def packer_gzip(file: BinaryIO) -> gzip.GzipFile:
    """A file packed by gzip into another one: the same bytes at any time."""
    return gzip.GzipFile(filename="", mode="wb", fileobj=file, mtime=0)


def unpack_gzip(path: Path, content: bytes) -> bytes:
    """Unpack; raises InputError for other content."""
    try:
        return gzip.decompress(content)
    except (OSError, EOFError, zlib.error) as error:
        raise _damaged(path, "a file packed by gzip", error) from None


def packer_zstd(file: BinaryIO) -> Any:
    """A file packed by zstd into another one, which stays open."""
    return _arrow().CompressedOutputStream(_Open(file), "zstd")


class _Open(io.RawIOBase):
    """A file that stays open when its writer is closed."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def writable(self) -> bool:
        return True

    def write(self, content: Any) -> int:
        return self._file.write(content)


def unpack_zstd(path: Path, content: bytes) -> bytes:
    """Unpack; raises InputError for other content."""
    arrow = _arrow()
    try:
        with arrow.CompressedInputStream(arrow.BufferReader(content), "zstd") as stream:
            return bytes(stream.read())
    except Exception as error:  # pyarrow's
        raise _damaged(path, "a file packed by zstd", error) from None


def fast_table(body: bytes | memoryview, names: list[str]) -> FloatArray | None:
    """Parse lines of plain numbers, as `text.parse_csv` would; None where anything is unusual.

    Returns
    -------
    float64 (rows, columns) or None
        NaN for an empty field, or "nan". None: pyarrow is not here, or the lines must be looked at
        one by one, for whatever they hold that is no finite number.
    """
    try:
        csv, arrow = import_module("pyarrow.csv"), import_module("pyarrow")
    except ImportError:
        return None
    try:
        table = csv.read_csv(
            arrow.BufferReader(body),
            csv.ReadOptions(column_names=names),
            csv.ParseOptions(quote_char=False, ignore_empty_lines=False),
            csv.ConvertOptions(
                column_types=dict.fromkeys(names, arrow.float64()),
                null_values=["", "nan", "NaN"],
                check_utf8=False,
            ),
        )
    except arrow.ArrowInvalid:
        return None
    values = np.empty((table.num_rows, len(names)), order="F")
    for k, column in enumerate(table.columns):
        values[:, k] = column.to_numpy()
        missing = np.count_nonzero(np.isnan(values[:, k]))
        if missing != column.null_count or np.isinf(values[:, k]).any():
            return None
    # A row without any number may be an empty line, which arrow takes for one.
    blank = np.isnan(values[:, 0])
    return None if blank.any() and np.isnan(values[blank]).all(axis=1).any() else values


def fast_rows(columns: list[FloatArray]) -> bytes | None:
    """Write lines as `text.format_csv` does, to the byte; None without pyarrow."""
    try:
        arrow, compute = import_module("pyarrow"), import_module("pyarrow.compute")
    except ImportError:
        return None
    texts = []
    for values in columns:
        text = compute.cast(arrow.array(values), arrow.string())
        size = np.abs(values)
        # Python writes "5.0", where arrow has "5"; beyond these limits the exponents differ too.
        is_integer = (values == np.floor(values)) & (size < 1e10)
        by_repr = ~is_integer & ((size < 1e-4) | (size >= 1e10))
        if is_integer.any():
            zero = compute.binary_join_element_wise(text.filter(arrow.array(is_integer)), ".0", "")
            text = compute.replace_with_mask(text, arrow.array(is_integer), zero)
        if by_repr.any():
            reprs = arrow.array(list(map(repr, values[by_repr].tolist())))
            text = compute.replace_with_mask(text, arrow.array(by_repr), reprs)
        if (missing := np.isnan(values)).any():
            text = compute.if_else(arrow.array(missing), "", text)
        texts.append(text)
    lines = compute.binary_join_element_wise(*texts, ",")
    rows = compute.binary_join_element_wise(lines, "", "\n")
    first, last = rows.offset, rows.offset + len(rows)
    ends = np.frombuffer(rows.buffers()[1], np.int32)
    return memoryview(rows.buffers()[2])[ends[first] : ends[last]].tobytes()
