"""Results as words, tables, figures, pages and files."""
