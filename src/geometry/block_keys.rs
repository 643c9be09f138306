//! Keys of blocks of space, each once, in the order in which they came.

/// Keys reach this many blocks from the origin along each axis.
pub const KEY_REACH: i32 = 1 << 20;

/// A set of keys, found in constant time.
#[derive(Clone, Debug)]
pub struct BlockKeys {
    all: Vec<[i32; 3]>,
    /// Open addressing with linear probing: position of the key plus one, 0 = none.
    slots: Vec<u32>,
}

impl Default for BlockKeys {
    fn default() -> Self {
        Self {
            all: Vec::new(),
            slots: vec![0; 1 << 12],
        }
    }
}

impl BlockKeys {
    /// The keys, in their order.
    pub fn all(&self) -> &[[i32; 3]] {
        &self.all
    }

    /// The position of a key, if it is there.
    pub fn find(&self, key: [i32; 3]) -> Option<usize> {
        match self.slots[self.slot(key)] {
            0 => None,
            at => Some(at as usize - 1),
        }
    }

    /// Takes up a key; false where it is there already, or lies too far out to be addressed.
    pub fn insert(&mut self, key: [i32; 3]) -> bool {
        let slot = self.slot(key);
        if self.slots[slot] != 0 || key.iter().any(|k| k.abs() >= KEY_REACH) {
            return false;
        }
        self.all.push(key);
        self.slots[slot] = self.all.len() as u32;
        if self.all.len() * 2 > self.slots.len() {
            self.slots = vec![0; self.slots.len() * 2];
            for at in 0..self.all.len() {
                let slot = self.slot(self.all[at]);
                self.slots[slot] = at as u32 + 1;
            }
        }
        true
    }

    /// The slot that holds a key, or the free one where it belongs.
    fn slot(&self, key: [i32; 3]) -> usize {
        let [x, y, z] = key.map(|k| u64::from((k.wrapping_add(KEY_REACH)) as u32));
        let packed = x | (y << 21) | (z << 42);
        let mask = self.slots.len() - 1;
        let mut slot = (packed.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as usize & mask;
        loop {
            match self.slots[slot] {
                0 => return slot,
                at if self.all[at as usize - 1] == key => return slot,
                _ => slot = (slot + 1) & mask,
            }
        }
    }
}
