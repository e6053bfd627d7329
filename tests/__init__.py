"""Tests, in folders as the code; `tests.support` holds their instruments."""
