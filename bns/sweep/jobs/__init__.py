"""What a worker is handed and how: jobs, batches, pools of processes, Dask, memory and cores."""
