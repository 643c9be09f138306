//! SHA-256 of what was read, so that a result names its evidence.

use sha2::{Digest as _, Sha256};

/// A digest that is fed piece by piece, each piece with its name.
#[derive(Clone, Default)]
pub struct Digest(Sha256);

impl Digest {
    /// Adds a named piece; name and length are part of the digest, so pieces cannot run together.
    pub fn add(&mut self, name: &str, bytes: &[u8]) {
        self.0.update((name.len() as u64).to_le_bytes());
        self.0.update(name.as_bytes());
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    /// The digest so far as lower-case hexadecimal.
    pub fn hex(&self) -> String {
        self.0.clone().finalize().iter().map(|b| format!("{b:02x}")).collect()
    }
}

/// The digest of one piece.
pub fn digest_of(bytes: &[u8]) -> String {
    let mut digest = Digest::default();
    digest.add("", bytes);
    digest.hex()
}
