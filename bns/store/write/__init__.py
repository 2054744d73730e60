"""What changes a store: the writer, folding of journals, compaction, repair."""
