"""Tables by the libraries that read them: Parquet (pyarrow), MAT (scipy), ``.npz``.

Each gives arrays by the names of the columns, with units in brackets; in a MAT file, whose names
cannot hold them, in a struct ``units``. ``gyr``, ``acc`` and ``mag`` (n, 3) become ``gx`` to
``mz``, ``q`` (n, 4) becomes ``qw`` to ``qz``, and ``fs`` [Hz] a column ``dt``.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.declarations import QUATERNION
from boresight.model.errors import require
from boresight.model.tools.external import optional
from boresight.sim.records.nine_axis import TRIADS
from boresight.sim.records.record import Place, Record, columns_of, joined, name_of

#: Arrays by the names of their columns.
Arrays: TypeAlias = Sequence[tuple[str, npt.NDArray[Any]]]

#: Arrays of several columns, and these.
_TRIPLES = {**{key: names for key, (names, _) in TRIADS.items()}, "q": QUATERNION}
#: Bytes of all arrays of an archive, at most.
_LARGEST = 4 << 30


def records_of(
    read: Callable[[BinaryIO], Iterator[Arrays]], path: Path, file: BinaryIO
) -> Iterator[Record]:
    """The records of a file's arrays, in blocks that follow each other."""
    start, where = 0, str(path)
    for arrays in read(file):
        require(bool(arrays), where, "arrays", "an empty archive", "store one array per column")
        columns, faults = columns_of(where, _flattened(where, arrays), copy=False)
        yield Record(name_of(path), columns, Place(where, start=start), where, faults=faults)
        start += len(next(iter(columns.values())).values)


def _flattened(where: str, arrays: Arrays) -> Arrays:
    """Split arrays of several columns, and make ``fs`` a column ``dt``."""
    flat: list[tuple[str, npt.NDArray[Any]]] = []
    rate: npt.NDArray[Any] | None = None
    for key, array in arrays:
        names = _TRIPLES.get(key)
        if key == "fs":
            rate = array
        elif names is None or array.ndim == 1:
            flat.append((key, array))
        else:
            is_table = array.ndim == 2 and array.shape[1] == len(names)
            wanted = f"shape (n, {len(names)})"
            place, fix = f"{where}, array {key}", "store one row per sample"
            require(is_table, place, wanted, str(array.shape), fix)
            flat += [(name, array[:, k]) for k, name in enumerate(names)]
    if rate is not None and flat:
        is_rate = rate.size == 1 and rate.dtype.kind in "iuf" and 0.0 < rate.item() < np.inf
        fix = "correct it, or leave it out to use the times"
        require(is_rate, f"{where}, fs", "one number above 0 (Hz)", rate.tolist(), fix)
        flat.append(("dt", np.full(flat[0][1].shape[:1], 1.0 / float(rate.item()))))
    return flat


def read_npz(file: BinaryIO) -> Iterator[Arrays]:
    """Arrays of an archive; raises InputError for more bytes than `_LARGEST`."""
    content = io.BytesIO(file.read())
    if not zipfile.is_zipfile(content):
        raise ValueError("no archive, as numpy.savez writes it")
    content.seek(0)
    archive = np.load(content, allow_pickle=False)
    size = sum(info.file_size for info in archive.zip.infolist())
    wanted, found = f"at most {_LARGEST >> 30} GiB of arrays", f"{size / 2**30:.3g} GiB, unpacked"
    fix = "write it as Parquet, which is read in pieces"
    require(size <= _LARGEST, getattr(file, "name", "archive"), wanted, found, fix)
    arrays = [(key, archive[key]) for key in archive.files]
    if not all(isinstance(array, np.ndarray) for _, array in arrays):
        raise ValueError("a member is no array")
    yield arrays


def read_mat(file: BinaryIO) -> Iterator[Arrays]:
    """Vectors and matrices of a MAT file up to version 7."""
    try:
        contents = optional("scipy.io").loadmat(io.BytesIO(file.read()))
    except NotImplementedError:
        raise ValueError("version 7.3, which is HDF5: save it with -v7") from None
    units = contents.pop("units", np.zeros(0))
    heads = {n: f"{n}[{units[n].item().item()}]" for n in units.dtype.names or ()}
    arrays = {heads.get(n, n): np.asarray(a) for n, a in contents.items() if n[:2] != "__"}
    # MATLAB has matrices only: a row or a column is a vector.
    yield [(n, a.ravel() if a.ndim == 2 and 1 in a.shape else a) for n, a in arrays.items()]


def read_parquet(file: BinaryIO) -> Iterator[Arrays]:
    """Columns of a Parquet file, 65,536 rows at a time."""
    parquet, is_empty = optional("pyarrow.parquet"), True
    file = file if file.seekable() else io.BytesIO(file.read())
    # A buffer for reading ahead would be held to the end of the file.
    table = parquet.ParquetFile(file, pre_buffer=False, page_checksum_verification=True)
    for batch in table.iter_batches(batch_size=1 << 16):
        is_empty = False
        yield _numbers(batch)
    if is_empty:  # which is refused
        yield [(name, np.zeros(0)) for name in table.schema_arrow.names]


def _numbers(batch: Any) -> Arrays:
    """Columns of an arrow batch as arrays."""
    batch.validate(full=True)
    arrays = [column.to_numpy(zero_copy_only=False) for column in batch.columns]
    return list(zip(batch.schema.names, arrays, strict=True))


def _heads(record: Record) -> dict[str, FloatArray]:
    """Columns of a record by name, with their units in brackets."""
    return {c.head(name): c.values for name, c in record.columns.items()}


def write_npz(file: BinaryIO, blocks: Iterable[Record]) -> None:
    """Write one array for each column."""
    np.savez_compressed(file, allow_pickle=False, **_heads(joined([*blocks])))


def write_mat(file: BinaryIO, blocks: Iterable[Record]) -> None:
    """Write a column vector for each column, and the struct ``units``."""
    columns, buffer = joined([*blocks]).columns, io.BytesIO()
    arrays: dict[str, Any] = {n: c.values[:, None] for n, c in columns.items()}
    if units := {n: c.unit for n, c in columns.items() if c.unit is not None}:
        arrays["units"] = units
    optional("scipy.io").savemat(buffer, arrays, long_field_names=True, do_compression=True)
    # scipy writes the time into the head.
    file.write(b"MATLAB 5.0 MAT-file".ljust(116) + buffer.getvalue()[116:])


def write_parquet(file: BinaryIO, blocks: Iterable[Record]) -> None:
    """Write blocks that follow each other: a column for each, compressed by LZ4.

    Bytes of like weight stand together (BYTE_STREAM_SPLIT): measured values repeat too seldom for
    a dictionary, which takes four times as long and twice the space.
    """
    parquet, writer = optional("pyarrow.parquet"), None
    for block in blocks:
        table = optional("pyarrow").table(_heads(block))
        if writer is None:
            options = {"use_dictionary": False, "use_byte_stream_split": True}
            writer = parquet.ParquetWriter(file, table.schema, compression="lz4", **options)
        writer.write_table(table)
    if writer is not None:
        writer.close()
