//! The OrchardBench benchmark: tasks, metrics, zones, statistics and records.
