"""Sentences, tables, figures and files of the gap workflow."""
