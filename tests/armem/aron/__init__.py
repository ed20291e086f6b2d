"""Tests of ARON: data objects, type objects, their codecs and conversions."""
