"""Tests of long-term memory: consolidation into elm, and what is found there again."""
