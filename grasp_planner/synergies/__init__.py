"""Synergy spaces q̄ + S σ: principal components, files, the human hand and its postures carried over."""
