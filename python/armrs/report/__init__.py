"""Results as sentences, tables, figures, pages and files."""
