use embassy_time::Duration;
use thud_emulator::emulator::{Emulator, Settings};
use thud_emulator::image::Image;

#[test]
fn boots() {
    let image = Image::read(&Image::usual_place()).unwrap();
    let mut emulator = Emulator::new(&image, &Settings::default(), thud_sim::force::Untouched);
    let host = emulator.bus().attach_host("host");
    let began = std::time::Instant::now();
    for _ in 0..20 {
        emulator.run_for(Duration::from_millis(50));
        if emulator.chip().violations().len() > 0 {
            break;
        }
    }
    eprintln!("{:?} wall for {}", began.elapsed(), emulator.now());
    for line in emulator.log() {
        eprintln!("  {line}");
    }
    eprintln!("violations {:#?}", emulator.chip().violations());
    eprintln!("faults {:#?}", emulator.machine().faults());
    eprintln!("starts {:?}", emulator.starts());
    eprintln!(
        "instructions {} busy {} samples {} stack {}",
        emulator.machine().instructions(),
        emulator.machine().busy() / 1_000_000,
        emulator.chip().samples(),
        emulator.machine().stack_used()
    );
    while let Some(a) = host.receive() {
        eprintln!("{a:?}");
    }
}
