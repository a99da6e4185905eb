//! What crosses floors.
