"""Functional mock-up units: read, check, run as a slave."""
