//! Harvest controllers: observations in, commands out.
