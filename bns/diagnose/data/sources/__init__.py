"""Files of a lab as tables: text, parquet, JSON lines and bags. Columns, units and rows stay as they were written."""
