//! What no mechanism explains: described by what it depends on, modelled as a map without a name.
//!
//! The residual is regressed on forms that any impact has: powers of stroke and speed while touching, a wave along the stroke where one stands
//! out (a magnet's detent, teeth), sines over the contact time (also times speed and mass), and slow curves after separation. What the fit's
//! own coordinates could do instead is fitted along, so that the map holds only what they cannot. A ridge, chosen on recordings left out, keeps it from following the noise.
//!
//! A map is not a mechanism: it holds where the recordings have been, not beyond.

use nalgebra::{DMatrix, DVector};
use thud_sim::rig::Quantity;

use super::conditions::weights;
use super::fit::{Fit, Tangent};
use super::held_out::folds;
use super::locate::Course;
use super::predict;
use super::problem::{Prepared, Problem};

/// Ridges that are tried, as squared inverse deviations of the forms' coefficients in units of the noise.
const RIDGES: [f64; 4] = [1e-6, 1e-4, 1e-2, 1.0];
/// Sines over the contact time.
const SINES: usize = 10;

/// Waves along the stroke are sought from one to so many over the deepest one, in steps of a quarter.
const MOST_WAVES: u32 = 48;
const STEPS_A_WAVE: u32 = 4;
/// And are there where the squares along a sine and a cosine are more than this: chance gives as much in one trial of 10⁵, two hundred are made.
const STANDS_OUT: f64 = 23.0;

/// A map of the rest.
#[derive(Clone, Debug)]
pub struct Map {
    /// What it adds to the model, on the thinned samples of each recording (all series).
    pub added: Vec<Vec<f64>>,
    /// Mean square of recording minus model at the thinned samples of the observed channel, on recordings left out: without and with.
    pub held_out_square: (f64, f64),
    /// A formula in stroke and speed, where one fits.
    pub form: String,
}

struct Form {
    /// Empty: no formula is made of it.
    name: String,
    /// Whitened values in each recording.
    whitened: Vec<Vec<f64>>,
    /// The same, not whitened.
    plain: Vec<Vec<f64>>,
}

/// Makes a map of what a fit leaves.
#[must_use]
pub fn map(problem: &Problem, fit: &Fit, tangent: &Tangent) -> Option<Map> {
    let forms = forms(problem, fit)?;
    let folds = folds(problem);
    let count = folds.iter().max().map_or(1, |most| most + 1);
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let square_of = |ridge: Option<f64>| -> f64 {
        let mut sum = 0.0;
        let mut samples = 0;
        for fold in 0..count {
            let train: Vec<usize> = all.iter().copied().filter(|number| folds[*number] != fold).collect();
            let left_out: Vec<usize> = all.iter().copied().filter(|number| folds[*number] == fold).collect();
            if train.is_empty() {
                continue;
            }
            let coefficients = ridge.and_then(|ridge| solve(fit, tangent, &forms, &train, ridge));
            for number in left_out {
                let added = coefficients.as_ref().map(|c| sum_of(&forms, c, number, true));
                let rest = tangent.local_rest(number, &difference(&fit.residuals[number], added.as_deref()));
                let plain = unwhitened_square(&problem.recordings[number], &rest);
                sum += plain.0;
                samples += plain.1;
            }
        }
        sum / samples.max(1) as f64
    };
    let without = square_of(None);
    let (ridge, with) =
        RIDGES.into_iter().map(|ridge| (ridge, square_of(Some(ridge)))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let coefficients = solve(fit, tangent, &forms, &all, ridge)?;
    Some(Map {
        added: all.iter().map(|number| sum_of(&forms, &coefficients, *number, false)).collect(),
        held_out_square: (without, with.min(without)),
        form: formula(problem, fit, tangent, &forms),
    })
}

fn difference(residual: &[f64], added: Option<&[f64]>) -> Vec<f64> {
    match added {
        Some(added) => residual.iter().zip(added).map(|(r, a)| r - a).collect(),
        None => residual.to_vec(),
    }
}

/// The square sum of a whitened residual of the observed channel, brought back to its unit by the noise's strength, and its samples.
fn unwhitened_square(recording: &Prepared, whitened: &[f64]) -> (f64, usize) {
    let samples = recording.times_s.len();
    let rms = recording.noise[0].rms();
    (whitened[..samples].iter().map(|w| (w * rms).powi(2)).sum(), samples)
}

fn sum_of(forms: &[Form], coefficients: &DVector<f64>, recording: usize, whitened: bool) -> Vec<f64> {
    let of = |form: &Form| if whitened { form.whitened[recording].clone() } else { form.plain[recording].clone() };
    let mut sum = vec![0.0; forms.first().map_or(0, |form| of(form).len())];
    for (form, coefficient) in forms.iter().zip(coefficients.iter()) {
        for (value, part) in sum.iter_mut().zip(of(form)) {
            *value += coefficient * part;
        }
    }
    sum
}

/// Coefficients of the forms from some recordings, the fit's coordinates moving along.
fn solve(fit: &Fit, tangent: &Tangent, forms: &[Form], train: &[usize], ridge: f64) -> Option<DVector<f64>> {
    let part = tangent.only(train);
    let normal = part.normal(0.0)?;
    let projected: Vec<Vec<Vec<f64>>> = forms
        .iter()
        .map(|form| {
            let here: Vec<Vec<f64>> = train.iter().map(|number| form.whitened[*number].clone()).collect();
            let (global, locals) = part.transposed(&here);
            let imitated = part.times(&normal.solve(&global, &locals));
            here.iter().zip(&imitated).map(|(form, i)| form.iter().zip(i).map(|(f, i)| f - i).collect()).collect()
        })
        .collect();
    let dot = |a: &[Vec<f64>], b: &mut dyn Iterator<Item = &Vec<f64>>| -> f64 {
        a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()).sum()
    };
    let size = forms.len();
    let scale: Vec<f64> = projected.iter().map(|form| dot(form, &mut form.iter()).sqrt().max(1e-12)).collect();
    let mut matrix = DMatrix::zeros(size, size);
    let mut right = DVector::zeros(size);
    for row in 0..size {
        for column in 0..=row {
            let value = dot(&projected[row], &mut projected[column].iter()) / scale[row] / scale[column];
            matrix[(row, column)] = value;
            matrix[(column, row)] = value;
        }
        matrix[(row, row)] += ridge + 1e-9;
        right[row] = dot(&projected[row], &mut train.iter().map(|number| &fit.residuals[*number])) / scale[row];
    }
    let solved = matrix.cholesky()?.solve(&right);
    Some(DVector::from_iterator(size, solved.iter().zip(&scale).map(|(value, scale)| value / scale)))
}

fn forms(problem: &Problem, fit: &Fit) -> Option<Vec<Form>> {
    struct Seen {
        position: Vec<f64>,
        velocity: Vec<f64>,
        course: Course,
    }
    let seen: Option<Vec<Seen>> = (0..problem.recordings.len())
        .map(|number| {
            let impact = predict::strike(problem, &fit.layout, &fit.point, number).ok()?;
            let course = Course::of(problem, fit, number);
            let since: Vec<f64> =
                problem.recordings[number].times_s.iter().map(|time| time - course.contact_s).collect();
            Some(Seen {
                position: impact.sample(Quantity::Position, &since),
                velocity: impact.sample(Quantity::Velocity, &since),
                course,
            })
        })
        .collect();
    let seen = seen?;
    let touching = |number: usize, place: usize| {
        let time = problem.recordings[number].times_s[place];
        time >= seen[number].course.contact_s && time < seen[number].course.separation_s
    };
    let most = |values: &dyn Fn(&Seen) -> &Vec<f64>| -> f64 {
        seen.iter()
            .enumerate()
            .flat_map(|(number, seen)| {
                values(seen).iter().enumerate().filter(move |(place, _)| touching(number, *place)).map(|(_, v)| v.abs())
            })
            .fold(1e-12, f64::max)
    };
    let (x_most, v_most) = (most(&|seen| &seen.position), most(&|seen| &seen.velocity));
    let form = |name: &str, value: &dyn Fn(usize, usize) -> f64| {
        let plain: Vec<Vec<f64>> = problem
            .recordings
            .iter()
            .enumerate()
            .map(|(number, recording)| {
                let mut values: Vec<f64> = (0..recording.times_s.len()).map(|place| value(number, place)).collect();
                // The map is of the observed channel.
                values.resize(recording.rows(), 0.0);
                values
            })
            .collect();
        let whitened: Vec<Vec<f64>> = plain
            .iter()
            .zip(&problem.recordings)
            .map(|(values, recording)| {
                let mut values = values.clone();
                recording.whiten(&mut values);
                values
            })
            .collect();
        Form { name: name.to_owned(), whitened, plain }
    };
    let wave = |waves: f64| {
        let pitch_mm = 1e3 * x_most / waves;
        let along = |number: usize, place: usize, shape: fn(f64) -> f64| {
            let turns = waves * seen[number].position[place] / x_most;
            if touching(number, place) { shape(std::f64::consts::TAU * turns) } else { 0.0 }
        };
        [
            form(&format!("sin(2πx/{pitch_mm:.3} mm)"), &|number, place| along(number, place, f64::sin)),
            form(&format!("cos(2πx/{pitch_mm:.3} mm)"), &|number, place| along(number, place, f64::cos)),
        ]
    };
    let mut all = standing_out(fit, wave);
    let mut push = |name: &str, value: &dyn Fn(usize, usize) -> f64| {
        let form = form(name, value);
        if form.whitened.iter().flatten().any(|value| value.abs() > 1e-9) {
            all.push(form);
        }
    };
    type Shape = (&'static str, fn(f64, f64) -> f64);
    const POWERS: [Shape; 14] = [
        ("x", |x, _| x),
        ("x²", |x, _| x * x),
        ("x³", |x, _| x * x * x),
        ("v", |_, v| v),
        ("v²", |_, v| v * v),
        ("v·|v|", |_, v| v * v.abs()),
        ("x·v", |x, v| x * v),
        ("x²·v", |x, v| x * x * v),
        ("x·v²", |x, v| x * v * v),
        ("x·v·|v|", |x, v| x * v * v.abs()),
        ("sgn v", |_, v| v.signum()),
        ("x·sgn v", |x, v| x * v.signum()),
        ("√x", |x, _| x.max(0.0).sqrt()),
        ("√x·sgn v", |x, v| x.max(0.0).sqrt() * v.signum()),
    ];
    for (name, shape) in POWERS {
        push(name, &|number, place| {
            if touching(number, place) {
                shape(seen[number].position[place] / x_most, seen[number].velocity[place] / v_most)
            } else {
                0.0
            }
        });
    }
    for weights in &weights(problem) {
        for order in 1..=SINES {
            push("", &|number, place| {
                let course = seen[number].course;
                let along = (problem.recordings[number].times_s[place] - course.contact_s)
                    / (course.separation_s - course.contact_s).max(1e-9);
                let shape = (std::f64::consts::PI * order as f64 * along).sin();
                if (0.0..=1.0).contains(&along) { weights[number] * shape } else { 0.0 }
            });
        }
        for order in 0..4 {
            push("", &|number, place| {
                let recording = &problem.recordings[number];
                let course = seen[number].course;
                let last_s = recording.times_s[recording.times_s.len() - 1];
                let tail = (recording.times_s[place] - course.separation_s) / (last_s - course.separation_s).max(1e-9);
                if tail >= 0.0 { weights[number] * (std::f64::consts::PI * order as f64 * tail).cos() } else { 0.0 }
            });
        }
    }
    Some(all)
}

/// The wave along the stroke that the residual goes along with most, as a sine and a cosine; none where none stands out.
fn standing_out(fit: &Fit, wave: impl Fn(f64) -> [Form; 2]) -> Vec<Form> {
    let along = |form: &Form| -> f64 {
        let squares: f64 = form.whitened.iter().flatten().map(|value| value * value).sum();
        let products = form.whitened.iter().zip(&fit.residuals).flat_map(|(form, residual)| form.iter().zip(residual));
        products.map(|(form, residual)| form * residual).sum::<f64>().powi(2) / squares.max(1e-12)
    };
    let waves = (STEPS_A_WAVE..=STEPS_A_WAVE * MOST_WAVES).map(|step| f64::from(step) / f64::from(STEPS_A_WAVE));
    let each = waves.map(wave).map(|forms| (forms.iter().map(along).sum::<f64>(), forms));
    let strongest = each.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(squares, _)| *squares > STANDS_OUT);
    strongest.map_or_else(Vec::new, |(_, forms)| forms.into())
}

/// One or two terms in stroke x and speed v that explain most of the rest; empty where they explain less than half of what the forms do.
fn formula(problem: &Problem, fit: &Fit, tangent: &Tangent, forms: &[Form]) -> String {
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let gain = |chosen: &[usize]| -> f64 {
        let few: Vec<Form> = chosen
            .iter()
            .map(|place| Form {
                name: forms[*place].name.clone(),
                whitened: forms[*place].whitened.clone(),
                plain: Vec::new(),
            })
            .collect();
        let Some(coefficients) = solve(fit, tangent, &few, &all, 1e-6) else { return 0.0 };
        // At the optimum of a projected regression the gain is the coefficients' part of the score.
        few.iter()
            .zip(coefficients.iter())
            .map(|(form, c)| {
                c * form
                    .whitened
                    .iter()
                    .zip(&fit.residuals)
                    .flat_map(|(f, r)| f.iter().zip(r))
                    .map(|(f, r)| f * r)
                    .sum::<f64>()
            })
            .sum()
    };
    let named: Vec<usize> = (0..forms.len()).filter(|place| !forms[*place].name.is_empty()).collect();
    let whole = gain(&(0..forms.len()).collect::<Vec<_>>());
    let Some((one, first)) = named.iter().map(|place| (*place, gain(&[*place]))).max_by(|a, b| a.1.total_cmp(&b.1))
    else {
        return String::new();
    };
    if first > 0.8 * whole {
        return format!("{} (stroke x, its rate v)", forms[one].name);
    }
    let second = named
        .iter()
        .filter(|place| **place != one)
        .map(|place| (*place, gain(&[one, *place])))
        .max_by(|a, b| a.1.total_cmp(&b.1));
    match second {
        Some((two, both)) if both > 0.5 * whole => {
            format!("{} and {} (stroke x, its rate v)", forms[one].name, forms[two].name)
        }
        _ => "no formula of two terms in stroke and speed; it has a memory, or depends on time".to_owned(),
    }
}
