//! The `palpate` binary.

fn main() {}
