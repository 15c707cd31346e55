#![no_std]
//! Planar arm core.
