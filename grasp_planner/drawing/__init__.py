"""Meshes, pictures with Matplotlib, parts of pages, colours."""
