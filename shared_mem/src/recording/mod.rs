//! Clips and sessions on disk: the only code that knows MCAP.
