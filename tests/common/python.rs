//! The Python that runs the examples.

use std::process::Command;

/// A Python with numpy: the one that `PALPATE_PYTHON` names, else `python3`. Says so where there is none.
pub fn python() -> Option<String> {
    python_with("numpy")
}

/// The same with another module.
pub fn python_with(module: &str) -> Option<String> {
    let named = std::env::var("PALPATE_PYTHON").unwrap_or_else(|_| "python3".into());
    let tried = Command::new(&named).args(["-c", &format!("import {module}")]).output();
    let found = tried.is_ok_and(|output| output.status.success()).then_some(named);
    if found.is_none() {
        println!("skipped: there is no python3 with {module} (name one by PALPATE_PYTHON)");
    }
    found
}
