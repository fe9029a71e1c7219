"""Tests of the client and its examples."""
