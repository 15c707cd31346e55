"""Calculations that several workflows share."""
