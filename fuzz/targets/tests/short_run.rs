//! A short run of every target over its seeds and over mutations of them, the same every time. Hours of it are for
//! `cargo fuzz` (docs/fuzzing.md).

use std::path::Path;

use thud_fuzz_targets::TARGETS;

/// Mutations of each seed, and inputs of nothing but chance for each target.
const MUTATIONS: usize = 3_000;

/// xorshift64*, Marsaglia 2003 and Vigna 2016: all that is wanted of it is that it is the same everywhere.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11
    }

    fn below(&mut self, end: usize) -> usize {
        if end == 0 { 0 } else { (self.next() % end as u64) as usize }
    }

    /// Changes an input in one of the ways in which fuzzers do.
    fn mutate(&mut self, input: &mut Vec<u8>, other: &[u8]) {
        let at = self.below(input.len());
        match self.below(8) {
            0 if !input.is_empty() => input[at] ^= 1 << self.below(8),
            1 if !input.is_empty() => input[at] = self.next() as u8,
            2 if !input.is_empty() => input[at] = [0, 0xFF, 0x7F, 0x80, b'\n', b'#', b'.', b'-'][self.below(8)],
            3 => input.truncate(at),
            4 => input.insert(at, self.next() as u8),
            5 => {
                let end = at + self.below(input.len() - at);
                input.drain(at..end);
            }
            6 => {
                let (from, to) = (self.below(other.len()), self.below(other.len()));
                input.splice(at..at, other[from.min(to)..from.max(to)].iter().copied());
            }
            _ => {
                let (from, to) = (self.below(input.len()), self.below(input.len()));
                let piece = input[from.min(to)..from.max(to)].to_vec();
                input.splice(at..at, piece);
            }
        }
        input.truncate(8_192);
    }
}

fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../corpus").join(target);
    let files = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = files.map(|file| file.unwrap().path()).collect();
    // In an order that is the same everywhere.
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

fn run(name: &str) {
    let (_, target) = TARGETS.into_iter().find(|(known, _)| *known == name).expect("a target");
    let seeds = seeds(name);
    assert!(!seeds.is_empty(), "{name} has no seeds");
    let mut chance = Chance(0x9E37_79B9_7F4A_7C15);
    for seed in &seeds {
        target(seed);
        for _ in 0..MUTATIONS {
            let mut input = seed.clone();
            for _ in 0..=chance.below(6) {
                let other = &seeds[chance.below(seeds.len())];
                chance.mutate(&mut input, other);
            }
            target(&input);
        }
    }
    for _ in 0..MUTATIONS {
        let length = chance.below(600);
        let input: Vec<u8> = (0..length).map(|_| chance.next() as u8).collect();
        target(&input);
    }
}

macro_rules! short_runs {
    ($($name:ident),+) => {
        $(#[test]
        fn $name() {
            run(stringify!($name));
        })+

        #[test]
        fn every_target_is_here_and_in_the_folder_for_cargo_fuzz() {
            let here = [$(stringify!($name)),+];
            assert_eq!(TARGETS.map(|(name, _)| name), here);
            for name in here {
                let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz_targets").join(format!("{name}.rs"));
                assert!(file.is_file(), "{}", file.display());
            }
        }
    };
}

short_runs!(
    sdo_server,
    node,
    pdos,
    host_decoding,
    sdo_client,
    slcan,
    udp,
    log,
    campaign_toml,
    model_toml,
    recording_csv
);
