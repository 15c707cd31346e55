"""Functional mock-up units: read, check, export."""
