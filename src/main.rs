//! The `palpate` binary; see `palpate --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    palpate::cli::run()
}
