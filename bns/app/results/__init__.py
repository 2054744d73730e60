"""`bns explore results/`: the runs of a store, filtered, compared and looked at one by one, while a sweep goes on."""
