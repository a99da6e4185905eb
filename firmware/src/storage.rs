//! The configuration in flash, so that a power cut at any byte leaves the old or the new one.
//!
//! One item of a [`sequential_storage::map`] (a log of items over at least two pages, each item with its own CRC; the
//! highest revision wins), and in it:
//!
//! | offset | type | meaning |
//! |---|---|---|
//! | 0 | u8 | version of this layout, [`VERSION`] |
//! | 1 | u32 | revision |
//! | 5 | … | the configuration, postcard |
//! | end − 4 | u32 | CRC-32 (ISO-HDLC) of everything before |
//!
//! Beside it the lock ([`ConfigurationLock`]) and the count of starts, under keys of their own.
//!
//! Little-endian. The hash of a configuration is the CRC-32 of its postcard bytes, so that the same settings have the same
//! hash on every device. A record of another version is not guessed at: it reads as [`Loaded::Unreadable`] and the
//! defaults are used, which is told by EMCY.
//!
//! Nothing is written or erased while an impact is open (`between_impacts`).
//!
//! The futures of this module must run to their end: a write that is dropped half-way is a power cut.

use core::ops::Range;

use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use crate::board::AskedFlash;
use crate::configuration::Configuration;
use crate::configuration_lock::ConfigurationLock;
use crate::detector::Stamped;

mod between_impacts;

pub use between_impacts::ImpactWatch;
pub(crate) use between_impacts::closed;

use between_impacts::BetweenImpacts;

/// Version of the stored layout; changes with [`Configuration`].
pub const VERSION: u8 = 2;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
const KEY: u8 = 1;
/// The lock on the configuration.
const LOCK: u8 = 2;
/// How often the board has started: UNSIGNED32 and its complement.
const STARTS: u8 = 3;
/// Room for a record with its key, a multiple of every flash word up to 32 bytes.
const RECORD: usize = 192;

/// CRC-32 of the configuration's stored form.
#[must_use]
pub fn hash(configuration: &Configuration) -> u32 {
    let mut bytes = [0; RECORD];
    // It fits: a test stores the longest one.
    postcard::to_slice(configuration, &mut bytes).map_or(0, |stored| CRC.checksum(stored))
}

/// The configuration with its revision and hash.
#[must_use]
pub fn stamp(configuration: Configuration, revision: u32) -> Stamped {
    Stamped { configuration, revision, hash: hash(&configuration) }
}

/// What was found at start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loaded {
    /// A valid configuration.
    Found(Stamped),
    /// Nothing was ever stored.
    Nothing,
    /// Something is there that is no configuration of this firmware, or flash failed.
    Unreadable,
}

impl Loaded {
    /// The configuration to start with.
    #[must_use]
    pub fn or_default(self) -> Stamped {
        match self {
            Self::Found(stamped) => stamped,
            Self::Nothing | Self::Unreadable => stamp(Configuration::DEFAULT, 0),
        }
    }
}

/// The configuration was not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotStored {
    /// Flash failed, or its pages are worn out.
    Flash,
    /// What was read back is not what was written.
    ReadBack,
}

/// What a walk over all records found.
struct Found {
    configuration: Loaded,
    lock: Option<ConfigurationLock>,
    /// A record under the lock's key that is none.
    no_lock: bool,
    starts: u32,
    /// The walk broke off, or could not begin.
    failed: bool,
}

impl Default for Found {
    fn default() -> Self {
        Self { configuration: Loaded::Nothing, lock: None, no_lock: false, starts: 0, failed: false }
    }
}

impl Found {
    fn take(&mut self, key: u8, record: &[u8]) {
        match key {
            KEY => match (decode(record), self.configuration) {
                (Some(found), Loaded::Found(best)) if found.revision < best.revision => {}
                (Some(found), _) => self.configuration = Loaded::Found(found),
                (None, Loaded::Nothing) => self.configuration = Loaded::Unreadable,
                (None, _) => {}
            },
            LOCK => match ConfigurationLock::decode(record) {
                Some(found) if self.lock.is_none_or(|best| found.counter() >= best.counter()) => {
                    self.lock = Some(found)
                }
                Some(_) => {}
                None => self.no_lock = true,
            },
            STARTS => {
                if let [a, b, c, d, e, f, g, h] = *record
                    && u32::from_le_bytes([a, b, c, d]) == !u32::from_le_bytes([e, f, g, h])
                {
                    self.starts = self.starts.max(u32::from_le_bytes([a, b, c, d]));
                }
            }
            _ => {}
        }
    }

    fn broken_off(mut self) -> Self {
        self.failed = true;
        if self.configuration == Loaded::Nothing {
            self.configuration = Loaded::Unreadable;
        }
        self
    }

    fn lock(&self) -> Option<ConfigurationLock> {
        let unknown = self.failed || self.no_lock && self.lock.is_none();
        (!unknown).then_some(self.lock.unwrap_or(ConfigurationLock::OPEN))
    }
}

/// The store over a range of flash pages, at least two.
pub struct Store<F: AskedFlash> {
    map: MapStorage<u8, BetweenImpacts<F>, Cache<Uncached, Uncached, Uncached, u8>>,
}

impl<F: AskedFlash> Store<F> {
    /// A store in these bytes of the flash.
    ///
    /// # Panics
    /// When the range does not hold at least two whole pages; the board's memory map decides that at build time.
    #[must_use]
    pub const fn new(flash: F, range: Range<u32>) -> Self {
        let flash = BetweenImpacts { flash, watch: None };
        Self { map: MapStorage::new(flash, MapConfig::new(range), Cache::new_uncached()) }
    }

    /// Lets every word and page from now on wait while an impact is open.
    pub fn wait_for_impacts(&mut self, watch: &'static dyn ImpactWatch) {
        self.map.flash().watch = Some(watch);
    }

    /// Reads the configuration: among all records the valid one with the highest revision.
    pub async fn load(&mut self) -> Loaded {
        self.scan().await.configuration
    }

    /// Writes the configuration and reads it back. A flash whose log is beyond repair is erased and tried once more.
    ///
    /// # Errors
    /// [`NotStored`]; the configuration that was stored before is then still there, unless the log was beyond repair.
    pub async fn save(&mut self, stamped: &Stamped) -> Result<(), NotStored> {
        let mut record = [0; RECORD];
        let length = encode(stamped, &mut record).ok_or(NotStored::ReadBack)?;
        self.put(KEY, &record[..length]).await?;
        match self.scan().await.configuration {
            Loaded::Found(found) if found == *stamped => Ok(()),
            _ => Err(NotStored::ReadBack),
        }
    }

    /// Reads the lock: among all stored the one with the highest counter. `None` when something is there that is no lock of this
    /// firmware, or flash failed: then nobody may change the configuration.
    pub async fn load_lock(&mut self) -> Option<ConfigurationLock> {
        self.scan().await.lock()
    }

    /// Writes the lock and reads it back.
    ///
    /// # Errors
    /// [`NotStored`]; the lock that was stored before then still holds after a start.
    pub async fn save_lock(&mut self, lock: &ConfigurationLock) -> Result<(), NotStored> {
        self.put(LOCK, &lock.encode()).await?;
        if self.scan().await.lock() == Some(*lock) { Ok(()) } else { Err(NotStored::ReadBack) }
    }

    /// Counts a start of the board: the lock, as [`Self::load_lock`], and how many starts there were, this one included; 0 when
    /// flash failed.
    pub async fn start(&mut self) -> (Option<ConfigurationLock>, u32) {
        let found = self.scan().await;
        let starts = found.starts.wrapping_add(1);
        let mut record = [0; 8];
        record[..4].copy_from_slice(&starts.to_le_bytes());
        record[4..].copy_from_slice(&(!starts).to_le_bytes());
        let counted = !found.failed && self.put(STARTS, &record).await.is_ok();
        (found.lock(), if counted { starts } else { 0 })
    }

    /// Writes a record. A flash whose log is beyond repair is erased and tried once more.
    async fn put(&mut self, key: u8, record: &[u8]) -> Result<(), NotStored> {
        let mut buffer = [0; RECORD];
        let mut erased = false;
        loop {
            match self.map.store_item(&mut buffer, &key, &record).await {
                Ok(()) => return Ok(()),
                Err(sequential_storage::Error::Corrupted { .. }) if !erased => {
                    self.map.erase_all().await.map_err(|_| NotStored::Flash)?;
                    erased = true;
                }
                Err(_) => return Err(NotStored::Flash),
            }
        }
    }

    /// Looks at every record.
    ///
    /// Not simply at the map's newest items: an erase that was cut short at the far end of a page makes the map take
    /// that page for the one in use, and its last intact item for the newest.
    async fn scan(&mut self) -> Found {
        let mut buffer = [0; RECORD];
        let mut found = Found::default();
        // Fetching one item repairs a page whose erasing was cut short; in version 8.0.2 the walk over all does not.
        if self.map.fetch_item::<&[u8]>(&mut buffer, &KEY).await.is_err() {
            return found.broken_off();
        }
        let Ok(mut items) = self.map.fetch_all_items(&mut buffer).await else { return found.broken_off() };
        loop {
            match items.next::<&[u8]>(&mut buffer).await {
                Ok(Some((key, record))) => found.take(key, record),
                Ok(None) => return found,
                Err(_) => return found.broken_off(),
            }
        }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.map.destroy().0.flash
    }
}

fn encode(stamped: &Stamped, record: &mut [u8; RECORD]) -> Option<usize> {
    record[0] = VERSION;
    record[1..5].copy_from_slice(&stamped.revision.to_le_bytes());
    let end = 5 + postcard::to_slice(&stamped.configuration, &mut record[5..RECORD - 4]).ok()?.len();
    let crc = CRC.checksum(&record[..end]);
    record[end..end + 4].copy_from_slice(&crc.to_le_bytes());
    Some(end + 4)
}

fn decode(record: &[u8]) -> Option<Stamped> {
    let (content, crc) = record.split_last_chunk::<4>()?;
    let (head, stored) = content.split_first_chunk::<5>()?;
    if head[0] != VERSION || CRC.checksum(content) != u32::from_le_bytes(*crc) {
        return None;
    }
    let configuration: Configuration = postcard::from_bytes(stored).ok()?;
    // A range that has become narrower since, for instance.
    configuration.validate().ok()?;
    let revision = u32::from_le_bytes([head[1], head[2], head[3], head[4]]);
    Some(Stamped { configuration, revision, hash: CRC.checksum(stored) })
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;
    use std::vec;
    use std::vec::Vec;

    use embassy_futures::block_on;
    use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

    use super::*;
    use crate::limits::Region;
    use crate::units::Kilogram;

    const PAGE: usize = 2048;
    const PAGES: usize = 2;

    /// Two pages of the STM32G474: 8-byte words that can be written once, and a supply that ends after so many bytes.
    #[derive(Clone)]
    struct Mortal {
        bytes: Box<[u8]>,
        written: Vec<bool>,
        /// Bytes that may still be written or erased.
        life: usize,
        used: usize,
        backwards: bool,
    }

    #[derive(Debug)]
    struct Dead;

    impl NorFlashError for Dead {
        fn kind(&self) -> NorFlashErrorKind {
            NorFlashErrorKind::Other
        }
    }

    impl Mortal {
        fn new() -> Self {
            Self {
                bytes: vec![0xFF; PAGE * PAGES].into(),
                written: vec![false; PAGE * PAGES / 8],
                life: usize::MAX,
                used: 0,
                backwards: false,
            }
        }

        fn live(&mut self) -> Result<(), Dead> {
            self.life = self.life.checked_sub(1).ok_or(Dead)?;
            self.used += 1;
            Ok(())
        }
    }

    impl ErrorType for Mortal {
        type Error = Dead;
    }

    impl ReadNorFlash for Mortal {
        const READ_SIZE: usize = 1;

        async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Dead> {
            bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
            Ok(())
        }

        fn capacity(&self) -> usize {
            self.bytes.len()
        }
    }

    impl NorFlash for Mortal {
        const WRITE_SIZE: usize = 8;
        const ERASE_SIZE: usize = PAGE;

        async fn erase(&mut self, from: u32, to: u32) -> Result<(), Dead> {
            assert!((from as usize).is_multiple_of(PAGE) && (to as usize).is_multiple_of(PAGE));
            // An erase that is cut short may leave either end of the page.
            let order = |step: u32| if self.backwards { to - 1 - step } else { from + step } as usize;
            for at in (0..to - from).map(order) {
                self.life = self.life.checked_sub(1).ok_or(Dead)?;
                self.used += 1;
                self.bytes[at] = 0xFF;
                self.written[at / 8] = false;
            }
            Ok(())
        }

        async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Dead> {
            assert!(offset.is_multiple_of(8) && bytes.len().is_multiple_of(8));
            for (at, byte) in (offset as usize..).zip(bytes) {
                // RM0440, 3.3.7: a double word is programmed once; only zeros may be written over it.
                assert!(
                    !at.is_multiple_of(8) || !self.written[at / 8] || bytes.iter().all(|byte| *byte == 0),
                    "a word of this flash can be written once only"
                );
                self.live()?;
                self.written[at / 8] = true;
                self.bytes[at] &= byte;
            }
            Ok(())
        }
    }

    impl AskedFlash for Mortal {}

    fn store(flash: Mortal) -> Store<Mortal> {
        Store::new(flash, 0..(PAGE * PAGES) as u32)
    }

    fn numbered(revision: u32) -> Stamped {
        let mut configuration = Configuration::DEFAULT;
        configuration.region = Some(Region::Hand);
        configuration.effective_mass = Some(Kilogram(1.0 + (revision % 500) as f32));
        configuration.effective_mass_max_age_ms = 60_000;
        stamp(configuration, revision)
    }

    #[test]
    fn an_empty_flash_holds_nothing_and_a_stored_configuration_comes_back() {
        let mut first = store(Mortal::new());
        assert_eq!(block_on(first.load()), Loaded::Nothing);
        for revision in 1..60 {
            block_on(first.save(&numbered(revision))).unwrap();
        }
        let mut second = store(first.into_flash());
        assert_eq!(block_on(second.load()), Loaded::Found(numbered(59)));
    }

    /// The one that matters: after every count of stored configurations that the pages can be filled with, the next save
    /// is cut at every single byte that it writes or erases.
    #[test]
    fn a_power_cut_at_any_byte_leaves_the_old_or_the_new_configuration() {
        cut_everywhere(Mortal::new(), ConfigurationLock::OPEN);
        cut_everywhere(Mortal { backwards: true, ..Mortal::new() }, ConfigurationLock::OPEN);
    }

    /// And none opens a lock, or takes back its counter, or the count of starts.
    #[test]
    fn a_power_cut_at_any_byte_leaves_the_lock() {
        let mut lock = ConfigurationLock::OPEN;
        lock.set_key([7; 16]);
        cut_everywhere(Mortal::new(), lock);
        cut_everywhere(Mortal { backwards: true, ..Mortal::new() }, lock);
    }

    fn cut_everywhere(mut flash: Mortal, lock: ConfigurationLock) {
        if lock.is_locked() {
            let mut store = store(flash);
            block_on(store.save_lock(&lock)).unwrap();
            assert_eq!(block_on(store.start()), (Some(lock), 1));
            flash = store.into_flash();
        }
        let mut cuts = 0;
        // Long enough to go through both pages and their erasing twice.
        for revision in 1..=60 {
            let whole = {
                let mut store = store(flash.clone());
                block_on(store.save(&numbered(revision))).unwrap();
                store.into_flash()
            };
            for life in 0..whole.used - flash.used {
                let mut dying = flash.clone();
                dying.life = life;
                let mut interrupted = store(dying);
                assert!(block_on(interrupted.save(&numbered(revision))).is_err());
                let mut revived = interrupted.into_flash();
                revived.life = usize::MAX;
                let mut store = store(revived);
                let found = block_on(store.load());
                let old = if revision == 1 { Loaded::Nothing } else { Loaded::Found(numbered(revision - 1)) };
                assert!(
                    found == old || found == Loaded::Found(numbered(revision)),
                    "revision {revision} cut after {life} bytes: {found:?}"
                );
                assert_eq!(block_on(store.load_lock()), Some(lock), "revision {revision} cut after {life} bytes");
                assert_eq!(block_on(store.scan()).starts, u32::from(lock.is_locked()));
                // And life goes on; a closed lock is written before each configuration.
                if lock.is_locked() {
                    block_on(store.save_lock(&lock)).unwrap();
                }
                block_on(store.save(&numbered(1000 + revision))).unwrap();
                assert_eq!(block_on(store.load()), Loaded::Found(numbered(1000 + revision)));
                assert_eq!(block_on(store.load_lock()), Some(lock));
                cuts += 1;
            }
            flash = whole;
        }
        assert!(cuts > 2 * PAGE, "pages were erased in between: {cuts} cuts");
    }

    #[test]
    fn garbage_is_not_guessed_at() {
        let mut flash = Mortal::new();
        for (at, byte) in flash.bytes.iter_mut().enumerate() {
            *byte = (at * 37) as u8;
        }
        let mut store = store(flash);
        assert_ne!(block_on(store.load()), Loaded::Found(numbered(1)));
        store.map.flash().flash.written.fill(false);
        block_on(store.save(&numbered(1))).unwrap();
        assert_eq!(block_on(store.load()), Loaded::Found(numbered(1)));
    }

    #[test]
    fn a_record_of_another_version_is_unreadable() {
        let mut record = [0; RECORD];
        let length = encode(&numbered(4), &mut record).unwrap();
        assert_eq!(decode(&record[..length]), Some(numbered(4)));
        record[0] = VERSION + 1;
        let crc = CRC.checksum(&record[..length - 4]);
        record[length - 4..length].copy_from_slice(&crc.to_le_bytes());
        assert_eq!(decode(&record[..length]), None);
    }
}
