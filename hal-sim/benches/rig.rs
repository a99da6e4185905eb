//! Time of one simulated impact, for each mechanism at its typical strength: the ideal rig, each mechanism alone, and
//! some together. 0.3 s after contact, the force sampled at 10 kHz through the chain.
//!
//! `cargo bench -p thud-sim --bench rig`

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use thud_sim::mechanism::{Effect, LIST};
use thud_sim::rig::{Accuracy, Approach, Quantity, Rig};

fn impacts(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("impact of 0.3 s");
    group.sample_size(20).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(600));
    let rig = Rig::impact(25e3).with_pad(80e3);
    let approach = Approach::new(0.25, 6.08);
    let times: Vec<f64> = (0..3000).map(|index| f64::from(index) * 1e-4).collect();
    let mut cases: Vec<(String, Vec<Effect>)> = vec![("ideal".to_owned(), Vec::new())];
    cases.extend(LIST.iter().map(|mechanism| (mechanism.id.to_owned(), vec![mechanism.typical()])));
    let pairs = [["guide-friction", "moving-piece-inertia"], ["guide-friction", "hunt-crossley-damping"]];
    for pair in pairs {
        let effects = pair.iter().map(|id| Effect::new(id, &[]).expect("listed")).collect();
        cases.push((pair.join(" + "), effects));
    }
    for (name, effects) in &cases {
        group.bench_function(name, |bencher| {
            let mut force = vec![0.0; times.len()];
            bencher.iter(|| {
                let impact = rig.strike(black_box(&approach), effects, 0.3, Accuracy::default()).expect("a usual rig");
                impact.sample_into(Quantity::CellForce, &times, &mut force);
                impact.apply_chain(&times, &mut force);
                force[100]
            });
        });
    }
    group.finish();
}

criterion_group!(benches, impacts);
criterion_main!(benches);
