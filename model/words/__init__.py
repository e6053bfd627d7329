"""Words of W bits: arithmetic, function tables, programs and the interpreter."""
