"""How everything is measured: options, clocks, scratch memories, circumstances, progress and findings."""
