"""Words of W bits: their meaning, tables, programs of them and the interpreter."""
