//! What forecasts promise: the corrected equation, honest folds, numbers that are smartcore's own, an export that says the same.

use std::collections::BTreeSet;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use smartcore::linalg::basic::matrix::DenseMatrix;
use smartcore::tree::decision_tree_regressor::{DecisionTreeRegressor, DecisionTreeRegressorParameters};
use smartcore::xgboost::{XGRegressor, XGRegressorParameters};
use thud_firmware::forecast::{DUE, Rise, TABLE};

use super::dataset::{Dataset, Impact, Sample};
use super::export::{Constants, NoTable};
use super::learner::{self, Boosting, Learned, Learner, NotLearned, boosted, learn};
use super::plan::{Kind, MASSES_KG, POSTURES_DEG, campaigns};
use super::predictor::{Predictor, train};
use super::score::{quantile, score};
use super::task::{CASES, Input, RISE, Rows, Task};
use super::trial::{NoTrial, Whole, folds, forecasts, parted, trials};

/// Ideal impacts with some scatter of the peak: half sines, four to a campaign.
fn ideal(count: usize, seed: u64) -> Dataset {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let impacts = (0..count)
        .map(|number| {
            let speed = chance.random_range(0.1..0.5);
            let mass = chance.random_range(4.0..12.0);
            let stiffness = [25e3, 50e3, 150e3][number % 3];
            let scatter = 1.0 + chance.random_range(-0.02..0.02);
            let pulsation = f64::sqrt(stiffness / mass);
            let peak = scatter * speed * f64::sqrt(stiffness * mass);
            let force = |since_s: f64| peak * (pulsation * since_s).sin();
            Impact {
                file: format!("{number}.csv").into(),
                campaign: number / 4,
                speed_m_per_s: speed,
                mass_kg: mass,
                body_stiffness_n_per_m: stiffness,
                stiffness_n_per_m: stiffness,
                body_mass_kg: Some(4.4),
                joints_deg: Some([number as f64, 0.0, 0.0]),
                peak_n: peak,
                stroke_m: Some(peak / stiffness),
                profile: (1..9)
                    .map(|step| {
                        let time_s = f64::from(step) * 0.35 / pulsation;
                        Sample { time_s, stroke_m: Some(force(time_s) / stiffness), force_n: force(time_s) }
                    })
                    .collect(),
                rise: Rise { at: DUE.map(|due| due.0), force: DUE.map(|due| force(f64::from(due.0) + 3e-4) as f32) },
                ahead_s: 0.5 * std::f64::consts::PI / pulsation - 0.0043,
            }
        })
        .collect();
    Dataset { impacts, campaigns: count.div_ceil(4), notes: Vec::new() }
}

/// Rows of a curved function of three inputs.
fn curved(count: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut chance = ChaCha8Rng::seed_from_u64(5);
    let x: Vec<Vec<f64>> = (0..count)
        .map(|_| vec![chance.random::<f64>(), chance.random::<f64>(), 1e5 * chance.random::<f64>()])
        .collect();
    let y = x.iter().map(|row| 40.0 * row[0] * row[1] + 2e-4 * row[2]).collect();
    (x, y)
}

#[test]
fn what_smartcore_learned_says_the_same_here() {
    let (x, y) = curved(150);
    let matrix = DenseMatrix::new(x.len(), 3, x.concat(), false).unwrap();

    let parameters = DecisionTreeRegressorParameters::default()
        .with_min_samples_leaf(learner::TREE_LEAF)
        .with_min_samples_split(learner::TREE_SPLIT);
    let theirs: Vec<f64> = DecisionTreeRegressor::fit(&matrix, &y, parameters).unwrap().predict(&matrix).unwrap();
    let ours = learn(Learner::Tree, &x, &y).unwrap();
    for (row, theirs) in x.iter().zip(theirs) {
        assert_eq!(ours.forecast(row), theirs);
    }

    let boosting = Boosting { trees: 12, depth: 3, rate: 0.2 };
    let parameters = XGRegressorParameters::default()
        .with_n_estimators(boosting.trees)
        .with_max_depth(boosting.depth)
        .with_learning_rate(boosting.rate)
        .with_subsample(learner::BOOSTED_SUBSAMPLE)
        .with_min_child_weight(learner::TREE_LEAF)
        .with_lambda(learner::BOOSTED_LAMBDA)
        .with_base_score(y.iter().sum::<f64>() / y.len() as f64)
        .with_seed(0);
    let theirs = XGRegressor::fit(&matrix, &y, parameters).unwrap().predict(&matrix).unwrap();
    let ours = boosted(&x, &y, boosting).unwrap();
    for (row, theirs) in x.iter().zip(theirs) {
        assert!((ours.forecast(row) - theirs).abs() < 1e-9 * theirs.abs().max(1.0));
    }
}

#[test]
fn a_line_is_found_to_the_last_digits_though_its_inputs_differ_by_six_powers_of_ten() {
    let mut chance = ChaCha8Rng::seed_from_u64(6);
    let x: Vec<Vec<f64>> = (0..40).map(|_| vec![chance.random::<f64>(), 1e6 * chance.random::<f64>()]).collect();
    let y: Vec<f64> = x.iter().map(|row| 3.0 + 2.0 * row[0] - 5e-6 * row[1]).collect();
    let Learned::Linear { intercept, coefficients } = learn(Learner::Linear, &x, &y).unwrap() else { panic!() };
    assert!((intercept - 3.0).abs() < 1e-9 && (coefficients[0] - 2.0).abs() < 1e-9);
    assert!((coefficients[1] + 5e-6).abs() < 1e-15);
}

#[test]
fn support_vectors_follow_a_curve_that_a_line_cannot() {
    let (x, y) = curved(200);
    let error = |learner| {
        let learned = learn(learner, &x, &y).unwrap();
        let said: Vec<f64> = x.iter().map(|row| learned.forecast(row)).collect();
        score(&said, &y).rmse_N
    };
    let (line, vectors) = (error(Learner::Linear), error(Learner::Svr));
    assert!(vectors < 0.25 * line, "{vectors} N against {line} N");
}

#[test]
fn the_peak_is_v_times_the_root_of_k_m_and_not_of_2_k_m_as_printed() {
    let dataset = ideal(60, 1);
    let rows = Rows::new(Task::Peak, super::task::BEFORE, &dataset);
    let corrected = score(&rows.expected, &rows.y);
    assert!(corrected.r_squared > 0.995, "{corrected:?}");
    let printed: Vec<f64> = rows.expected.iter().map(|peak| peak * std::f64::consts::SQRT_2).collect();
    assert!((score(&printed, &rows.y).bias_N / rows.y.iter().sum::<f64>() * 60.0 - 0.414).abs() < 0.02);
}

#[test]
fn an_impact_is_never_on_both_sides_of_a_fold_nor_a_campaign_where_that_is_asked_for() {
    let dataset = ideal(60, 2);
    let rows = Rows::new(Task::Profile, super::task::PROFILE, &dataset);
    for whole in Whole::ALL {
        let fold_of = folds(&dataset, whole, 5, 3).unwrap();
        let mut tested_rows = 0;
        for fold in 0..5 {
            let (seen, tested) = parted(&rows, &fold_of, fold);
            tested_rows += tested.len();
            let of = |rows_of: &[usize]| -> BTreeSet<usize> {
                rows_of
                    .iter()
                    .map(|row| match whole {
                        Whole::Impact => rows.impact[*row],
                        Whole::Campaign => dataset.impacts[rows.impact[*row]].campaign,
                    })
                    .collect()
            };
            assert!(of(&seen).is_disjoint(&of(&tested)), "{whole:?}");
            assert!(!tested.is_empty());
        }
        assert_eq!(tested_rows, rows.len(), "each row is tested once");
    }
    assert_eq!(
        folds(&dataset, Whole::Campaign, 16, 0),
        Err(NoTrial::Folds { what: "campaigns", impacts: 15, folds: 16 })
    );
}

/// The paper's folds are over time samples: those of one impact are on both sides, and what a tree has seen of an impact it says
/// again. Over whole impacts the same tree on the same rows errs more.
#[test]
fn a_fold_over_samples_flatters() {
    let dataset = ideal(60, 13);
    let rows = Rows::new(Task::Profile, super::task::PROFILE, &dataset);
    let rmse = |rows: &Rows, groups: usize| {
        let places = ideal(groups, 0);
        let fold_of = folds(&places, Whole::Impact, 5, 3).unwrap();
        score(&forecasts(rows, Some(Learner::Boosted), false, &fold_of).unwrap(), &rows.y).rmse_N
    };
    let whole = rmse(&rows, dataset.impacts.len());
    let printed = rmse(&Rows { impact: (0..rows.len()).collect(), ..rows.clone() }, rows.len());
    assert!(printed < 0.8 * whole, "{printed} N over samples, {whole} N over impacts");
}

/// δ_max is the outcome: K·δ_max is the peak, chance and all, without anything learned. Nothing that is known before knows the chance.
#[test]
fn the_largest_stroke_leaks_the_peak() {
    let dataset = ideal(60, 14);
    let peaks: Vec<f64> = dataset.impacts.iter().map(|impact| impact.peak_n).collect();
    let of =
        |forecast: &dyn Fn(&Impact) -> f64| score(&dataset.impacts.iter().map(forecast).collect::<Vec<_>>(), &peaks);
    let leaky = of(&|impact| impact.stiffness_n_per_m * impact.stroke_m.unwrap_or_default());
    let honest = of(&Impact::ideal_peak_n);
    assert!(leaky.rmse_N < 1e-6 * honest.rmse_N && honest.rmse_N > 0.5, "{leaky:?} {honest:?}");
}

#[test]
fn every_case_with_a_stroke_is_marked_leaky_and_no_other() {
    for case in CASES {
        let strokes = case.inputs.iter().any(|input| matches!(input, Input::Stroke | Input::LargestStroke));
        assert_eq!(case.leaky(), strokes, "{case:?}");
        assert!(!case.physics || !case.leaky(), "physics is for what is known before: {case:?}");
    }
    assert_eq!(CASES.iter().filter(|case| case.printed.is_some()).count(), 6, "every figure of the paper");
}

#[test]
fn physics_with_a_remainder_beats_learning_all_from_few_impacts() {
    let dataset = ideal(60, 4);
    let fold_of = folds(&dataset, Whole::Impact, 5, 0).unwrap();
    let trials = trials(&dataset, &CASES, &fold_of, |_| {}).unwrap();
    assert_eq!(trials.len(), CASES.len());
    let rmse = |task, learner, physics| {
        let found = trials.iter().find(|trial| {
            trial.case.task == task
                && trial.case.learner == learner
                && trial.case.physics == physics
                && !trial.case.leaky()
        });
        found.unwrap().score.rmse_N
    };
    for task in [Task::Peak, Task::Online] {
        let (alone, both) = (rmse(task, Some(Learner::Boosted), false), rmse(task, Some(Learner::Boosted), true));
        assert!(both < 0.7 * alone, "{task:?}: {both} N against {alone} N");
    }
}

#[test]
fn the_exported_constants_say_what_the_predictor_says() {
    let dataset = ideal(200, 7);
    let predictor = train(&dataset, Task::Online, Learner::Table, true, (5, 0)).unwrap();
    let constants = Constants::new(&predictor).unwrap();
    assert!(constants.table().size() <= 2_048);
    let mut compared = 0;
    for impact in &dataset.impacts {
        let Some((said, _)) = predictor.forecast(impact).first().copied() else { continue };
        let table = constants.table().forecast(&impact.rise, &impact.known()).unwrap();
        // Leaves are rounded to 1/16384, of 18 trees.
        assert!((f64::from(table.peak.0) / said.force_n - 1.0).abs() < 1e-3, "{table:?} for {said:?}");
        assert!((f64::from(table.bound.0) / said.bound_n - 1.0).abs() < 2e-3);
        compared += 1;
    }
    assert!(compared > 150);
    let text = constants.rust(&["about".to_owned()]);
    assert!(text.contains("static TREES: [Tree; 18]") && text.contains("//! about"));
}

#[test]
fn what_the_sensor_cannot_evaluate_is_not_exported() {
    let dataset = ideal(80, 8);
    let peak = train(&dataset, Task::Peak, Learner::Boosted, true, (5, 0)).unwrap();
    assert!(matches!(Constants::new(&peak), Err(NoTable::Other(_))));
    let deep = train(&dataset, Task::Online, Learner::Tree, true, (5, 0)).unwrap();
    assert_eq!(Constants::new(&deep), Err(NoTable::TooDeep));
}

#[test]
fn a_predictor_comes_back_from_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("predictor.json");
    let dataset = ideal(60, 9);
    for learner in Learner::ALL {
        let predictor = train(&dataset, Task::Peak, learner, false, (5, 0)).unwrap();
        std::fs::write(&path, serde_json::to_string(&predictor).unwrap()).unwrap();
        let read = Predictor::read(&path).unwrap();
        for impact in &dataset.impacts {
            let (said, _) = predictor.forecast(impact)[0];
            let (again, _) = read.forecast(impact)[0];
            assert!((said.force_n - again.force_n).abs() < 1e-9 * said.force_n.abs());
        }
    }
    std::fs::write(&path, "{ \"format\": 3 }").unwrap();
    assert!(Predictor::read(&path).unwrap_err().to_string().contains("this is no predictor"));
}

#[test]
fn the_bounds_cover_what_they_promise_on_impacts_that_nobody_has_seen() {
    let predictor = train(&ideal(400, 10), Task::Peak, Learner::Boosted, true, (5, 0)).unwrap();
    let fresh = ideal(400, 11);
    let inside = fresh
        .impacts
        .iter()
        .flat_map(|impact| predictor.forecast(impact))
        .filter(|(said, truth)| (said.force_n - truth).abs() <= said.bound_n)
        .count();
    // 95 % with three standard deviations of 400 draws.
    assert!((367..=400).contains(&inside), "{inside} of 400");
}

#[test]
fn too_few_impacts_are_refused_with_their_number() {
    let few = ideal(6, 12);
    let error = train(&few, Task::Peak, Learner::Boosted, true, (3, 0)).unwrap_err();
    assert_eq!(error, NoTrial::NotLearned(NotLearned::TooFew { rows: 4, inputs: 3, least: 16 }));
    assert!(matches!(folds(&few, Whole::Impact, 7, 0), Err(NoTrial::Folds { .. })));
}

#[test]
fn quantiles_are_the_conformal_ones() {
    let values: Vec<f64> = (1..=99).map(f64::from).collect();
    assert_eq!(quantile(values, 0.95), 95.0);
    assert_eq!(quantile(vec![3.0, 1.0], 0.95), 3.0, "too few to promise more than the largest");
}

#[test]
fn the_plan_is_the_papers_and_its_masses_are_what_the_urdf_gives() {
    use crate::robot::contact::{Contact, Frame, direction};
    use crate::robot::effective_mass::assess;
    use crate::robot::posture::{Given, Posture};

    let plans = campaigns(Kind::Paper, 3, 0);
    assert_eq!(plans.len(), 15);
    assert!(plans.iter().all(|(_, plan)| plan.speeds_m_per_s.len() * plan.masses_kg.len() == 36));
    assert_eq!(campaigns(Kind::Paper, 3, 0), plans, "the same seed, the same plan");
    assert_ne!(campaigns(Kind::Paper, 3, 1), plans);

    let urdf = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/robots/iiwa14.urdf");
    let robot = crate::robot::description::read(urdf.as_ref()).unwrap();
    let link = robot.link("flange").unwrap();
    let contact = Contact {
        link,
        point_m: nalgebra::Point3::origin(),
        direction: direction(1.0, 0.0, 0.0).unwrap(),
        frame: Frame::Base,
    };
    for (posture, mass_kg) in POSTURES_DEG.iter().zip(MASSES_KG) {
        let values = posture.iter().map(|angle| angle.to_radians()).collect();
        let posture = Posture::new(&robot, link, &Given::InOrder(values)).unwrap();
        let found = assess(&robot, &posture, &contact).free_kg.unwrap();
        // A tenth of a kilogram: half of what the plan takes the stated mass to be unsure by.
        assert!((found - mass_kg).abs() < 0.1, "{found} kg, not {mass_kg}");
    }
}

#[test]
fn the_firmwares_inputs_are_in_the_order_of_the_rows() {
    let dataset = ideal(3, 13);
    let rows = Rows::new(Task::Online, RISE, &dataset);
    let impact = &dataset.impacts[rows.impact[0]];
    let (steps, expected) = impact.rise.inputs(&impact.known()).unwrap();
    assert_eq!(rows.x[0], steps.map(f64::from));
    assert_eq!(rows.expected[0], f64::from(expected));
    assert!(TABLE.forecast(&impact.rise, &impact.known()).is_some());
}
