//! The effective mass against Pinocchio, another people's rigid-body dynamics: real robots and random trees, random
//! postures, points, directions and tools.
//!
//! Inertia matrices, contact points and effective masses must agree within 1e-9.

use std::collections::HashMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nalgebra::Point3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use thud::robot::contact::{Contact, Frame, Orientation, direction};
use thud::robot::effective_mass::{Assessed, assess};
use thud::robot::joint_inertia::joint_inertia;
use thud::robot::posture::{Given, Posture};
use thud::robot::tool::Tool;
use thud::robot::{Motion, Robot, description};

mod python;

/// Postures of each robot.
const POSTURES: usize = 25;
/// Random trees.
const TREES: usize = 40;
/// What is wanted.
const AGREEMENT: f64 = 1e-9;

fn script() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/effective_mass.py")
}

/// What Pinocchio says to all cases.
fn ask(python: &Path, cases: &[Value]) -> Vec<Value> {
    let mut child = Command::new(python).arg(script()).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let lines: String = cases.iter().map(|case| format!("{case}\n")).collect();
    let mut stdin = child.stdin.take().unwrap();
    // Written beside reading, or both sides would wait for each other.
    let writer = std::thread::spawn(move || stdin.write_all(lines.as_bytes()));
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "effective_mass.py says above what is wrong");
    writer.join().unwrap().unwrap();
    String::from_utf8(output.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// One posture of one robot, hit somewhere: what we say, and the case for Pinocchio.
struct Trial {
    name: String,
    inertia: nalgebra::DMatrix<f64>,
    moving_mass_kg: f64,
    assessed: Assessed,
    case: Value,
}

fn trial(name: &str, robot: &Robot, random: &mut ChaCha8Rng) -> Trial {
    let moving: Vec<usize> = (0..robot.links.len()).filter(|&link| robot.moves(link)).collect();
    // Mostly far out, where an arm has its hands.
    let link = if random.random_bool(0.7) {
        *moving.iter().max_by_key(|&&link| robot.way_to(link).len()).unwrap()
    } else {
        moving[random.random_range(0..moving.len())]
    };
    let movable = robot.movable();
    let mut values = Vec::new();
    for &joint in &movable {
        let (low, high) = robot.joints[joint].range.unwrap_or((-3.0, 3.0));
        values.push((robot.joints[joint].name.clone(), random.random_range(low..=high)));
    }
    // Now and then some stand still.
    if random.random_bool(0.2) && values.len() > 7 {
        values.retain(|_| random.random_bool(0.8));
    }
    let posture = Posture::new(robot, link, &Given::Named(values)).unwrap();
    let mut number = |scale: f64| random.random_range(-scale..scale);
    let point = [number(0.2), number(0.2), number(0.2)];
    let towards = [number(1.0), number(1.0), number(1.0)];
    let centre = [number(0.1), number(0.1), number(0.1)];
    let frame = if number(1.0) < 0.0 { Frame::Base } else { Frame::Link };
    let mass = number(2.0);
    let tool = Tool::new(
        link,
        mass.max(0.0),
        centre,
        if mass > 0.0 { [0.01, 0.02, 0.015, 0.001, -0.002, 0.003] } else { [0.0; 6] },
    );
    let tool = tool.unwrap();
    let contact = Contact {
        link,
        point_m: Point3::from(point),
        direction: direction(towards[0], towards[1], towards[2]).unwrap(),
        frame,
    };
    let mounted = tool.map_or_else(|| robot.clone(), |tool| tool.mounted_on(robot));
    let joint = |joint: &usize| robot.joints[*joint].name.clone();
    let values: HashMap<String, f64> = movable.iter().map(|index| (joint(index), posture.values[*index])).collect();
    let mut case = json!({
        "urdf": robot.source.file, "link": robot.links[link].name, "point": point, "direction": towards,
        "frame": frame.name(), "joints": values, "free": posture.free.iter().map(joint).collect::<Vec<_>>(),
    });
    if tool.is_some() {
        case["tool"] = json!({
            "link": robot.links[link].name, "mass": mass, "centre": centre,
            "inertia": [0.01, 0.02, 0.015, 0.001, -0.002, 0.003],
        });
    }
    Trial {
        name: name.to_owned(),
        inertia: joint_inertia(&mounted, &posture),
        moving_mass_kg: mounted.moving_mass_kg(),
        assessed: assess(&mounted, &posture, &contact),
        case,
    }
}

/// What was compared.
#[derive(Debug, Default)]
struct Compared {
    free: usize,
    held: usize,
    worst: f64,
}

fn compare(trials: &[Trial], answers: &[Value]) -> Compared {
    assert_eq!(trials.len(), answers.len());
    let mut compared = Compared::default();
    for (trial, answer) in trials.iter().zip(answers) {
        let said = |what: &str| answer[what].as_f64();
        let about = || format!("{}: {}", trial.name, trial.case);
        let rows: Vec<Vec<f64>> = serde_json::from_value(answer["inertia"].clone()).unwrap();
        let largest = trial.inertia.amax();
        for (row, values) in rows.iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                let ours = trial.inertia[(row, column)];
                assert!(
                    (ours - value).abs() <= AGREEMENT * largest,
                    "M[{row},{column}] {ours} and {value}: {}",
                    about()
                );
            }
        }
        for (ours, axis) in trial.assessed.point_m.iter().zip(answer["point"].as_array().unwrap()) {
            assert!((ours - axis.as_f64().unwrap()).abs() < AGREEMENT, "{}", about());
        }
        let close = |ours: Option<f64>, what: &str, worst: &mut f64| {
            let (Some(ours), Some(theirs)) = (ours, said(what)) else {
                panic!("{ours:?} and {}: {}", answer[what], about())
            };
            let off = (ours / theirs - 1.0).abs();
            assert!(off < AGREEMENT, "{what}: {ours} kg and {theirs} kg, {off:e} apart: {}", about());
            *worst = worst.max(off);
        };
        close(Some(trial.moving_mass_kg), "moving_mass", &mut compared.worst);
        // A direction in which hardly anything moves loses digits in both.
        if said("free").is_some_and(|mass| mass < 1e4) {
            close(trial.assessed.free_kg, "free", &mut compared.worst);
            compared.free += 1;
        }
        if said("held").is_some_and(|mass| mass < 1e4) && trial.assessed.massless.is_empty() {
            close(trial.assessed.held_kg, "held", &mut compared.worst);
            close(trial.assessed.mass_kg(Orientation::HeldYielding), "held_yielding", &mut compared.worst);
            compared.held += 1;
        }
    }
    compared
}

#[test]
fn real_robots_weigh_what_pinocchio_says() {
    let Some(python) = python::python("numpy, pinocchio") else { return };
    let output = Command::new(&python).arg(script()).arg("robots").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut robots: Vec<(String, PathBuf)> =
        serde_json::from_slice::<HashMap<String, PathBuf>>(&output.stdout).unwrap().into_iter().collect();
    robots.push(("iiwa14".into(), Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/robots/iiwa14.urdf")));
    robots.sort();
    assert!(robots.len() >= 9);
    let mut random = ChaCha8Rng::seed_from_u64(0x1B0);
    let mut trials = Vec::new();
    for (name, path) in &robots {
        let robot = description::read(path).unwrap_or_else(|error| panic!("{name}: {error}"));
        trials.extend((0..POSTURES).map(|_| trial(name, &robot, &mut random)));
    }
    let compared = compare(&trials, &ask(&python, &trials.iter().map(|trial| trial.case.clone()).collect::<Vec<_>>()));
    println!("{compared:?} of {}", trials.len());
    // Few directions are blocked, and many postures can be held.
    assert!(compared.free > trials.len() * 9 / 10, "{compared:?}");
    assert!(compared.held > trials.len() / 4, "{compared:?}");
}

/// A random tree: turning and sliding joints, followers, branches, links in crooked frames; the last links perhaps
/// without inertia.
fn tree(random: &mut ChaCha8Rng) -> String {
    let links = random.random_range(3..14);
    let mut text = "<robot name=\"tree\"><link name=\"base\"/>\n".to_owned();
    let mut leaders: Vec<String> = Vec::new();
    for link in 1..links {
        let mut number = |scale: f64| random.random_range(-scale..scale);
        let origin = format!(
            "<origin xyz=\"{} {} {}\" rpy=\"{} {} {}\"/>",
            number(0.4),
            number(0.4),
            number(0.4),
            number(3.0),
            number(1.5),
            number(3.0)
        );
        let axis = nalgebra::Vector3::new(number(1.0), number(1.0), number(1.0)).normalize();
        let axis = format!("<axis xyz=\"{} {} {}\"/>", axis.x, axis.y, axis.z);
        let centre = format!(
            "<origin xyz=\"{} {} {}\" rpy=\"{} {} {}\"/>",
            number(0.2),
            number(0.2),
            number(0.2),
            number(3.0),
            number(1.5),
            number(3.0)
        );
        let parent = match random.random_range(0..4) {
            0 => random.random_range(0..link),
            _ => link - 1,
        };
        let parent = if parent == 0 { "base".to_owned() } else { format!("l{parent}") };
        let kind = ["revolute", "revolute", "continuous", "prismatic", "fixed"][random.random_range(0..5)];
        let mimic = match leaders.len() {
            0 => String::new(),
            some if kind != "fixed" && random.random_bool(0.2) => {
                let leader = &leaders[random.random_range(0..some)];
                format!("<mimic joint=\"{leader}\" multiplier=\"{}\" offset=\"0.1\"/>", random.random_range(-2.0..2.0))
            }
            _ => String::new(),
        };
        if kind != "fixed" && mimic.is_empty() {
            leaders.push(format!("j{link}"));
        }
        text += &format!(
            "<joint name=\"j{link}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"l{link}\"/>{origin}{axis}{mimic}\
             <limit lower=\"-2\" upper=\"2.5\" effort=\"1\" velocity=\"1\"/></joint>\n"
        );
        let mass = random.random_range(0.1..6.0);
        let [x, y, z] = [(); 3].map(|()| random.random_range(0.001..0.05));
        // Sums of squares of extents: what a body can have.
        let inertial = format!(
            "<inertial>{centre}<mass value=\"{mass}\"/><inertia ixx=\"{}\" iyy=\"{}\" izz=\"{}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>",
            y + z,
            x + z,
            x + y
        );
        // A mere frame somewhere on the way.
        let bare = kind == "fixed" && random.random_bool(0.5);
        text += &format!("<link name=\"l{link}\">{}</link>\n", if bare { "" } else { &inertial });
    }
    text + "</robot>\n"
}

#[test]
fn random_trees_weigh_what_pinocchio_says() {
    let Some(python) = python::python("numpy, pinocchio") else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("trees");
    std::fs::create_dir_all(&folder).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut trials = Vec::new();
    let mut made = 0;
    while made < TREES {
        let text = tree(&mut random);
        let path = folder.join(format!("{made}.urdf"));
        std::fs::write(&path, &text).unwrap();
        let robot = description::read(&path).unwrap();
        // One that cannot move, or has no mass that moves, is no robot.
        if robot.movable().is_empty()
            || robot.joints.iter().all(|joint| joint.motion == Motion::Fixed)
            || robot.moving_mass_kg() == 0.0
        {
            continue;
        }
        made += 1;
        trials.extend((0..5).map(|_| trial(&format!("tree {made}"), &robot, &mut random)));
    }
    let compared = compare(&trials, &ask(&python, &trials.iter().map(|trial| trial.case.clone()).collect::<Vec<_>>()));
    println!("{compared:?} of {}", trials.len());
    assert!(compared.free > trials.len() / 2, "{compared:?}");
    assert!(compared.held > trials.len() / 40, "{compared:?}");
}

/// The seventh axis of the example without inertia: M has rank 6, and Pinocchio's M with numpy's pseudo-inverse says
/// the same.
#[test]
fn an_axis_without_inertia_is_left_out_alike() {
    let Some(python) = python::python("numpy, pinocchio") else { return };
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/robots/iiwa14.urdf"))
        .unwrap()
        .replace("<mass value=\"1.2\"/>", "<mass value=\"0\"/>")
        .replace("ixx=\"0.001\" iyy=\"0.001\" izz=\"0.001\"", "ixx=\"0\" iyy=\"0\" izz=\"0\"");
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bare_iiwa14.urdf");
    std::fs::write(&path, text).unwrap();
    let robot = description::read(&path).unwrap();
    let flange = robot.link("flange").unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut trials = Vec::new();
    for _ in 0..20 {
        let values: Vec<f64> = (0..7).map(|_| random.random_range(-2.0..2.0)).collect();
        let towards: [f64; 3] = [(); 3].map(|()| random.random_range(-1.0..1.0));
        let posture = Posture::new(&robot, flange, &Given::InOrder(values.clone())).unwrap();
        let contact = Contact {
            link: flange,
            point_m: Point3::new(0.0, 0.0, 0.05),
            direction: direction(towards[0], towards[1], towards[2]).unwrap(),
            frame: Frame::Base,
        };
        let names: Vec<String> = (1..=7).map(|axis| format!("A{axis}")).collect();
        let joints: HashMap<&String, f64> = names.iter().zip(values).collect();
        let assessed = assess(&robot, &posture, &contact);
        assert_eq!((assessed.rank, assessed.massless.len()), (6, 0));
        trials.push(Trial {
            name: "bare".into(),
            inertia: joint_inertia(&robot, &posture),
            moving_mass_kg: robot.moving_mass_kg(),
            // Held, the axis without inertia moves for nothing, which a pseudo-inverse of M cannot say.
            assessed: Assessed { massless: vec![6], ..assessed },
            case: json!({
                "urdf": path, "link": "flange", "point": [0.0, 0.0, 0.05], "direction": towards, "frame": "base",
                "joints": joints, "free": names,
            }),
        });
    }
    let compared = compare(&trials, &ask(&python, &trials.iter().map(|trial| trial.case.clone()).collect::<Vec<_>>()));
    assert_eq!((compared.free, compared.held), (20, 0));
}
