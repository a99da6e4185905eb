#[path = "../tests/struck/mod.rs"]
mod struck;
use struck::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let trials: u64 = args[1].parse().unwrap();
    let which = args.get(2).map_or("all", |s| s.as_str());
    let one: Option<usize> = args.get(3).and_then(|s| s.parse().ok());
    let mut cases = vec![];
    if which == "all" || which == "hard" { cases.extend(grid().into_iter().filter(|c| c.pad_n_per_m > 100e3)); 
      for body in [10e3, 25e3, 75e3, 150e3] { for v in [0.05,0.15,0.35,0.6] {
        cases.push(Case{ body_n_per_m: body, pad_n_per_m: 2e6, piece_kg: 0.12, damping: (0.03,0.01), speed_m_per_s: v, robot_kg: 6.0, further: &[] }); } }
    }
    if which == "all" || which == "soft" { cases.extend(grid().into_iter().filter(|c| c.pad_n_per_m < 100e3)); 
      for (body,pad) in [(10e3,17e3), (25e3,80e3), (75e3, 1000e3)] { for v in [0.05,0.15,0.35,0.6] {
        cases.push(Case{ body_n_per_m: body, pad_n_per_m: pad, piece_kg: 0.12, damping: (0.03,0.01), speed_m_per_s: v, robot_kg: 6.0, further: &[] }); } }
    }
    if which == "all" || which == "lossy" { cases.extend(lossy()); }
    let started = std::time::Instant::now();
    let (mut fails, mut n) = (0, 0); let (mut total, mut worst) = (0, 0);
    for (i, case) in cases.iter().enumerate() {
        if one.is_some_and(|o| o != i) { continue; }
        let from = args.get(4).map_or(0, |s| s.parse().unwrap());
        let mut errors = vec![]; let (mut most, mut sum, mut evals) = (0, 0, 0);
        use std::sync::atomic::Ordering::Relaxed;
        for seed in from..from+trials {
            thud_firmware::impact::WORK.store(0, Relaxed);
            errors.extend(case.errors_s(seed..seed+1));
            let w = thud_firmware::impact::WORK.load(Relaxed);
            sum += w; most = most.max(w);
        }
        total += sum; worst = worst.max(most);
        if std::env::var("W").is_ok() { println!("{i} work mean {} most {most}", sum/trials); }
        let bound = Case { further: &[], ..case.clone() }.bound_s();
        let ratio = rms(&errors) / promised_s(bound);
        n += 1;
        if ratio > 1.0 { fails += 1; }
        if ratio > 1.0 || one.is_some() {
            let mut s = errors.iter().map(|e| (e*1e6) as i32).collect::<Vec<_>>(); s.sort();
            println!("{i:3} pad {:6} body {:5} m {:.2} v {:.2} f {:.0}: rms {:.0} bound {:.1} ratio {ratio:.2} {:?} {:?}", case.pad_n_per_m/1e3, case.body_n_per_m/1e3, case.piece_kg, case.speed_m_per_s, case.ring_hertz(), rms(&errors)*1e6, bound*1e6, s, case.further);
        }
    }
    println!("{fails} of {n} fail, {:?}; work mean {} worst {worst}", started.elapsed(), total / n / trials);
}
