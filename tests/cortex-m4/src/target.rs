//! The run on the target.

mod counter;
mod stages;

use cortex_m_rt::entry;
use semihosting::fs::File;
use semihosting::io::{self, Read as _};
use semihosting::{print, println, process};
use static_cell::StaticCell;
use thud_cortex_m4::{Meter, Run};
use thud_firmware::board::{AdcCode, BLOCK};

use self::counter::Counter;
use self::stages::STRETCH;

/// Bytes that are read from the host at a time.
const CHUNK: usize = 4096;

static RUN: StaticCell<Run> = StaticCell::new();

#[entry]
fn main() -> ! {
    match measure() {
        Ok(()) => process::exit(0),
        Err(error) => {
            println!("error {error:?}");
            process::exit(1)
        }
    }
}

/// What pushes took, while nothing touches and while an impact is open.
struct Pushes {
    counter: Counter,
    idle: Sum,
    open: Sum,
}

#[derive(Default)]
struct Sum {
    blocks: u64,
    instructions: f64,
    most: f64,
}

impl Meter for Pushes {
    fn count<R>(&mut self, impact_open: bool, work: impl FnOnce() -> R) -> R {
        let (result, instructions) = self.counter.count(work);
        let sum = if impact_open { &mut self.open } else { &mut self.idle };
        sum.blocks += 1;
        sum.instructions += instructions;
        sum.most = sum.most.max(instructions);
        result
    }
}

fn measure() -> io::Result<()> {
    let counter = Counter::start();
    let run = RUN.init_with(Run::new);
    let mut pushes = Pushes { counter, idle: Sum::default(), open: Sum::default() };
    let mut stretch = [0; STRETCH];
    let mut seen = 0;
    let mut file = File::open(c"counts")?;
    let mut chunk = [0; CHUNK];
    loop {
        let length = fill(&mut file, &mut chunk)?;
        for bytes in chunk[..length].chunks_exact(2 * BLOCK) {
            let mut codes: [AdcCode; BLOCK] = [0; BLOCK];
            for (code, pair) in codes.iter_mut().zip(bytes.chunks_exact(2)) {
                *code = AdcCode::from_le_bytes([pair[0], pair[1]]);
            }
            if let Some(place) = stretch.get_mut(seen..seen + BLOCK) {
                place.copy_from_slice(&codes);
            }
            seen += BLOCK;
            run.push(&codes, &mut pushes, |record| {
                print!("event ");
                for byte in record {
                    print!("{byte:02x}");
                }
                println!();
            });
        }
        if length < CHUNK {
            break;
        }
    }
    for (name, sum) in [("idle", &pushes.idle), ("open", &pushes.open)] {
        println!("count {name} {} {:.0}", sum.blocks * BLOCK as u64, sum.instructions);
        println!("most {name} {:.0}", sum.most);
    }
    stages::measure(&pushes.counter, &stretch);
    Ok(())
}

/// Reads until the chunk is full or the file ends.
fn fill(file: &mut File, chunk: &mut [u8; CHUNK]) -> io::Result<usize> {
    let mut length = 0;
    while length < CHUNK {
        match file.read(&mut chunk[length..])? {
            0 => break,
            read => length += read,
        }
    }
    Ok(length)
}
