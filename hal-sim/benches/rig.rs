//! Time of one simulated impact, for each mechanism at its typical strength: the ideal rig, each mechanism alone, and
//! some together. 0.3 s after contact, the force sampled at 10 kHz through the chain.
//!
//! `cargo bench -p thud-sim --bench rig`
//!
//! With `-- table` it prints, instead, what a fit can have: time, effort and the largest error of the force at the default
//! accuracy and at the one for fits, both against a far tighter one; with `-- differences`, how smooth the force is in every
//! parameter.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group};
use thud_sim::mechanism::{Effect, LIST};
use thud_sim::rig::{Accuracy, Approach, Impact, Quantity, Rig};

const END_S: f64 = 0.3;

fn rig() -> Rig {
    Rig::impact(25e3).with_pad(80e3)
}

fn approach() -> Approach {
    Approach::new(0.25, 6.08)
}

fn times_s() -> Vec<f64> {
    (0..3000).map(|index| f64::from(index) * 1e-4).collect()
}

fn cases() -> Vec<(String, Vec<Effect>)> {
    let mut cases: Vec<(String, Vec<Effect>)> = vec![("ideal".to_owned(), Vec::new())];
    cases.extend(LIST.iter().map(|mechanism| (mechanism.id.to_owned(), vec![mechanism.typical()])));
    let pairs = [["guide-friction", "moving-piece-inertia"], ["guide-friction", "hunt-crossley-damping"]];
    for pair in pairs {
        let effects = pair.iter().map(|id| Effect::new(id, &[]).expect("listed")).collect();
        cases.push((pair.join(" + "), effects));
    }
    cases
}

fn strike(effects: &[Effect], accuracy: Accuracy) -> Impact {
    rig().strike(black_box(&approach()), effects, END_S, accuracy).expect("a usual rig")
}

fn impacts(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("impact of 0.3 s");
    group.sample_size(20).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(600));
    let times = times_s();
    for (name, effects) in &cases() {
        group.bench_function(name, |bencher| {
            let mut force = vec![0.0; times.len()];
            bencher.iter(|| {
                let impact = strike(effects, Accuracy::default());
                impact.sample_into(Quantity::CellForce, &times, &mut force);
                impact.apply_chain(&times, 0.0, &mut force);
                force[100]
            });
        });
    }
    group.finish();
}

/// The shortest of many runs, µs: what other processes take is not in it.
fn shortest_us(mut run: impl FnMut()) -> f64 {
    let once = |run: &mut dyn FnMut()| {
        let begun = Instant::now();
        run();
        begun.elapsed().as_secs_f64() * 1e6
    };
    (0..300).map(|_| once(&mut run)).fold(f64::INFINITY, f64::min)
}

fn table() {
    let times = times_s();
    let tight = Accuracy { relative: 1e-11, force_n: 1e-9 };
    let levels = [Accuracy::default(), Accuracy { relative: 1e-5, force_n: 1e-3 }];
    println!(
        "| mechanism | strike µs | sample µs | evaluations | steps | largest error / peak | strike µs | sample µs | evaluations | steps | largest error / peak |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, effects) in &cases() {
        let exact = strike(effects, tight).measured_n(&times);
        let peak = exact.iter().copied().fold(0.0, f64::max);
        print!("| {name} ");
        for accuracy in levels {
            let impact = strike(effects, accuracy);
            let force = impact.measured_n(&times);
            let worst = force.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let mut buffer = vec![0.0; times.len()];
            let strike_us = shortest_us(|| {
                black_box(strike(effects, accuracy));
            });
            let sample_us = shortest_us(|| {
                impact.sample_into(Quantity::CellForce, &times, &mut buffer);
                impact.apply_chain(&times, 0.0, &mut buffer);
            });
            let effort = impact.effort();
            print!(
                "| {strike_us:.0} | {sample_us:.0} | {} | {}+{} | {:.1e} ",
                effort.evaluations,
                effort.steps,
                effort.rejected,
                worst / peak
            );
        }
        println!("|");
    }
}

/// For each mechanism and each of its parameters, and for the rig's own: by how much the central difference with a
/// relative step of 10⁻³ at an accuracy differs from the one at a far tighter accuracy, as a part of its size (root
/// mean square over the impact). Parameters that only choose (whole numbers, places in time) are left out.
fn differences() {
    let tight = Accuracy { relative: 1e-11, force_n: 1e-9 };
    let levels =
        [Accuracy::default(), Accuracy { relative: 1e-6, force_n: 1e-4 }, Accuracy { relative: 1e-5, force_n: 1e-3 }];
    let times = times_s();
    println!("| mechanism | parameter | size, N per unit of ln | relative error at 1e-7 | 1e-6 | 1e-5 |");
    println!("|---|---|---|---|---|---|");
    for (name, effects) in &cases() {
        let mut names = vec!["k_body", "k_pad", "mass", "speed"];
        if let [effect] = &effects[..] {
            names.extend(effect.mechanism().parameters.iter().map(|parameter| parameter.name));
        }
        for (place, parameter) in names.iter().enumerate() {
            let force = |factor: f64, accuracy: Accuracy| {
                let (mut rig, mut approach, mut effects) = (rig(), approach(), effects.clone());
                match place {
                    0 => rig.body_stiffness_n_per_m *= factor,
                    1 => rig.pad_stiffness_n_per_m = rig.pad_stiffness_n_per_m.map(|pad| pad * factor),
                    2 => approach.effective_mass_kg *= factor,
                    3 => approach.speed_m_per_s *= factor,
                    _ => {
                        let value = effects[0].value(place - 4);
                        // A step of 10⁻³ where the value is zero, inside of what is possible.
                        let moved = if value == 0.0 { factor - 0.999 } else { value * factor };
                        effects[0].set_value(place - 4, moved).expect("near the typical value");
                    }
                }
                rig.strike(&approach, &effects, END_S, accuracy).expect("a usual rig").measured_n(&times)
            };
            let slope = |accuracy: Accuracy| -> Vec<f64> {
                let (high, low) = (force(1.001, accuracy), force(0.999, accuracy));
                high.iter().zip(low).map(|(high, low)| (high - low) / 2e-3).collect()
            };
            let rms =
                |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
            let exact = slope(tight);
            print!("| {name} | {parameter} | {:.3} ", rms(&exact));
            for accuracy in levels {
                let error: Vec<f64> = slope(accuracy).iter().zip(&exact).map(|(a, b)| a - b).collect();
                print!("| {:.1e} ", rms(&error) / rms(&exact));
            }
            println!("|");
        }
    }
}

criterion_group!(benches, impacts);

fn main() {
    if std::env::args().any(|argument| argument == "table") {
        table();
    } else if std::env::args().any(|argument| argument == "differences") {
        differences();
    } else {
        benches();
        Criterion::default().configure_from_args().final_summary();
    }
}
