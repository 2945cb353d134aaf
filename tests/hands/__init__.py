"""Tests of hands other than the DLR/HIT II."""
