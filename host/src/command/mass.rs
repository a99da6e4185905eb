//! `thud mass`: how heavy a robot is where it hits somebody.

use std::path::PathBuf;
use std::time::Duration;

use miette::{IntoDiagnostic as _, WrapErr as _};
use nalgebra::Point3;
use serde::Serialize;

use crate::bus::address::BusAddress;
use crate::client::Client;
use crate::client::words::searching;
use crate::interrupt;
use crate::json::JsonOption;
use crate::recording;
use crate::robot::contact::{self, Contact, Frame, Orientation};
use crate::robot::effective_mass::{Assessed, assess};
use crate::robot::iso_estimate::iso_estimate_kg;
use crate::robot::lumped::{lumped, usual_joints};
use crate::robot::posture::{Given, Posture};
use crate::robot::stated::{Setting, StatedMass};
use crate::robot::stream::{Received, Sender, is_sendable};
use crate::robot::tool::Tool;
use crate::robot::trajectory::Trajectory;
use crate::robot::{Motion, Robot, description};
use crate::settings::one_of;
use crate::table::{Side, Table};

/// Compute the effective mass of a robot at a contact point, from its URDF
///
/// What a blow at that point, along that direction, in that posture has to move: 1/m = nᵀ J M⁻¹ Jᵀ n, with M from the
/// links' masses and inertias. Beside it the same with the flange held, ISO's estimate M/2 + m_L, and a model of four
/// point masses.
///
/// With --trajectory it follows a motion, and with --bus it sends each value to a sensor as the robot's controller would.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Examples:\n  thud mass --urdf examples/robots/iiwa14.urdf --at flange --direction 1,0,0 --degrees \\\n      --joints=-56.6,87.6,-90,109.2,2.9,52.5,90 --tool-mass 0.5 --tool-com 0,0,0.05\n  thud mass --urdf arm.urdf --at tool --direction 0,0,1 --frame link --trajectory motion.csv --bus udp\n\nA trajectory is a CSV: time_s, then a column for each joint: A1_rad or A1_deg, lift_m. docs/robots.md explains what the values mean."
)]
pub struct Mass {
    /// The robot's description
    #[arg(long, value_name = "FILE")]
    urdf: PathBuf,
    #[command(flatten)]
    hit: Hit,
    #[command(flatten)]
    posture: PostureOptions,
    #[command(flatten)]
    tool: ToolOptions,
    #[command(flatten)]
    sent: SendOptions,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "Contact")]
struct Hit {
    /// The link that hits
    #[arg(long, value_name = "LINK")]
    at: String,
    /// Where on the link, in its frame, m
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", value_parser = triple, allow_hyphen_values = true)]
    point: [f64; 3],
    /// Direction of the blow; its length and sign do not matter
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    direction: [f64; 3],
    /// Whose axes the direction is in
    #[arg(long, default_value = Frame::Base.name(), value_parser = one_of(&Frame::ALL, Frame::name))]
    frame: Frame,
    /// What is held while the blow lasts: nothing (free, the paper's equation 8); orientation and path (held);
    /// orientation, but it may evade sideways (held-yielding)
    #[arg(long, default_value = Orientation::Free.name(), value_parser = one_of(&Orientation::ALL, Orientation::name))]
    orientation: Orientation,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "Posture")]
struct PostureOptions {
    /// Joint values in the order of the tree, rad and m: one for each joint, or one for each on the way to the link. Or
    /// by name, NAME=VALUE,…; joints without a value stand still
    #[arg(long, value_name = "VALUES", value_parser = given, allow_hyphen_values = true, required_unless_present = "trajectory")]
    joints: Option<Given>,
    /// Angles are in degrees
    #[arg(long)]
    degrees: bool,
    /// Follow a motion instead: joint values over time
    #[arg(long, value_name = "CSV", conflicts_with_all = ["joints", "degrees"])]
    trajectory: Option<PathBuf>,
    /// The joints at shoulder, elbow and wrist, for the model of point masses [default: of a usual arm]
    #[arg(long, value_name = "NAME,NAME,NAME", value_delimiter = ',')]
    lumps: Option<Vec<String>>,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "Tool or load")]
struct ToolOptions {
    /// Mass of a tool that the description does not have
    #[arg(long, value_name = "KG", default_value_t = 0.0)]
    tool_mass: f64,
    /// Its centre of mass in the frame of the link that carries it, m
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", value_parser = triple, allow_hyphen_values = true)]
    tool_com: [f64; 3],
    /// Its inertia about the centre of mass, kg m²: three moments, or six with ixy, ixz, iyz
    #[arg(long, value_name = "IXX,IYY,IZZ", default_value = "0,0,0", value_parser = six, allow_hyphen_values = true)]
    tool_inertia: [f64; 6],
    /// The link that carries it [default: the link that hits]
    #[arg(long, value_name = "LINK")]
    tool_at: Option<String>,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "To a sensor")]
struct SendOptions {
    /// Send the values to a sensor on this bus, again and again, as a robot controller does (can0, slcan:…, udp, …).
    /// The sensor takes them while it is Operational
    #[arg(long, value_name = "BUS")]
    bus: Option<BusAddress>,
    /// The sensor with this node id; needed where there are several
    #[arg(long, value_name = "ID", requires = "bus", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: Option<u8>,
    /// Values a second [default with --bus: 50; without: the trajectory's own times]
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// End after this time [default: the end of the trajectory; for one posture Ctrl-C]
    #[arg(long, value_name = "S", requires = "bus")]
    duration: Option<f64>,
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(',')
        .map(|part| {
            let part = part.trim();
            let number: f64 = part.parse().map_err(|_| format!("`{part}` is no number"))?;
            if number.is_finite() { Ok(number) } else { Err(format!("`{part}` is not finite")) }
        })
        .collect()
}

fn triple(text: &str) -> Result<[f64; 3], String> {
    let found = numbers(text)?;
    <[f64; 3]>::try_from(found)
        .map_err(|found| format!("three numbers are needed, separated by commas; here are {}", found.len()))
}

fn six(text: &str) -> Result<[f64; 6], String> {
    let found = numbers(text)?;
    match found[..] {
        [xx, yy, zz] => Ok([xx, yy, zz, 0.0, 0.0, 0.0]),
        [xx, yy, zz, xy, xz, yz] => Ok([xx, yy, zz, xy, xz, yz]),
        _ => Err(format!("three or six numbers are needed, separated by commas; here are {}", found.len())),
    }
}

fn given(text: &str) -> Result<Given, String> {
    if !text.contains('=') {
        return numbers(text).map(Given::InOrder);
    }
    text.split(',')
        .map(|part| {
            let (name, value) = part
                .split_once('=')
                .ok_or_else(|| format!("`{}` is not NAME=VALUE, as the others are", part.trim()))?;
            let value = value.trim();
            let number = value.parse().map_err(|_| format!("`{value}` is no number"))?;
            Ok((name.trim().to_owned(), number))
        })
        .collect::<Result<_, String>>()
        .map(Given::Named)
}

/// What the value is compared with.
#[derive(Clone, Serialize)]
struct Beside {
    free_kg: Option<f64>,
    held_kg: Option<f64>,
    held_yielding_kg: Option<f64>,
    /// M/2 + m_L.
    iso_kg: f64,
    moving_mass_kg: f64,
    load_kg: f64,
    lumped: Option<Lumps>,
    /// Why there is no lumped model.
    #[serde(skip_serializing_if = "Option::is_none")]
    lumped_missing: Option<String>,
}

#[derive(Clone, Serialize)]
struct Lumps {
    mass_kg: Option<f64>,
    shoulder_kg: f64,
    elbow_kg: f64,
    wrist_kg: f64,
    end_effector_kg: f64,
    /// The joints at shoulder, elbow and wrist.
    joints: [String; 3],
}

/// One posture.
#[derive(Serialize)]
struct Answer {
    #[serde(flatten)]
    value: StatedMass,
    beside: Beside,
    /// Rank of the joint-space inertia, and how many joints it has.
    rank: usize,
    free_joints: usize,
    without_inertia: Vec<String>,
    warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sent: Option<Sent>,
}

/// A motion.
#[derive(Serialize)]
struct Sweep {
    #[serde(flatten)]
    setting: Setting,
    trajectory: String,
    samples: Vec<Sample>,
    without_inertia: Vec<String>,
    warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sent: Option<Sent>,
}

#[derive(Clone, Serialize)]
struct Sample {
    time_s: f64,
    /// `null` where no joint moves the point in this direction.
    effective_mass_kg: Option<f64>,
    point_in_base_m: [f64; 3],
    direction_in_base: [f64; 3],
    beside: Beside,
}

#[derive(Serialize)]
struct Sent {
    bus: String,
    node: u8,
    frames: u32,
    /// Instants at which there was no value that a sensor takes.
    left_out: u32,
    /// What the sensor counted meanwhile.
    sensor: Received,
}

/// Frames a second where nothing else was asked for: five within the 100 ms after which a mass is stale by default.
const RATE_HZ: f64 = 50.0;
/// Faster than a CAN bus of 1 Mbit/s carries anything else beside it.
const FASTEST_HZ: f64 = 1000.0;

/// The robot with its tool, and how it is hit.
struct Case {
    robot: Robot,
    contact: Contact,
    orientation: Orientation,
    setting: Setting,
    load_kg: f64,
    iso_kg: f64,
    moving_mass_kg: f64,
    lumps: Result<[usize; 3], String>,
    without_inertia: Vec<String>,
}

impl Mass {
    pub(super) fn run(self) -> miette::Result<()> {
        let duration = interrupt::span(self.sent.duration)?;
        if let Some(rate) = self.sent.rate {
            miette::ensure!(
                rate > 0.0 && rate <= FASTEST_HZ,
                "--rate {rate} Hz is not possible: above 0 to {FASTEST_HZ} Hz are"
            );
        }
        let case = self.case()?;
        match &self.posture.trajectory {
            None => self.one(&case, duration),
            Some(path) => self.motion(&case, path, duration),
        }
    }

    fn case(&self) -> miette::Result<Case> {
        let bare = description::read(&self.urdf)?;
        let find = |name: &str| {
            bare.link(name).ok_or_else(|| {
                let links: Vec<&str> = bare.links.iter().map(|link| link.name.as_str()).collect();
                miette::miette!(help = format!("its links: {}", links.join(", ")), "{} has no link `{name}`", bare.name)
            })
        };
        let link = find(&self.hit.at)?;
        if !bare.moves(link) {
            miette::bail!(
                help = "choose a link behind a joint that moves",
                "link `{}` of {} does not move: whoever meets it hits the ground",
                self.hit.at,
                bare.name
            );
        }
        let [x, y, z] = self.hit.direction;
        let direction = contact::direction(x, y, z).map_err(|why| {
            miette::miette!(
                help = "give where the robot moves to, such as --direction 1,0,0 for the front of its base",
                "--direction {x},{y},{z}: {why}"
            )
        })?;
        let contact = Contact { link, point_m: Point3::from(self.hit.point), direction, frame: self.hit.frame };

        let carrier = self.tool.tool_at.as_deref().map_or(Ok(link), find)?;
        let tool =
            Tool::new(carrier, self.tool.tool_mass, self.tool.tool_com, self.tool.tool_inertia).map_err(|no| {
                miette::miette!(
                    help = "give a mass in kg, and with it an inertia in kg m² about the centre of mass",
                    "the tool is no rigid body: {no}"
                )
            })?;
        if tool.is_some() && self.tool.tool_at.is_none() && bare.has_joints_behind(link) {
            miette::bail!(
                help = "say which link carries the tool: --tool-at LINK",
                "joints lie behind link `{}`, so the tool is hardly there",
                self.hit.at
            );
        }
        let load_kg = tool.map_or(0.0, |tool| tool.body.mass_kg);
        if bare.moving_mass_kg() == 0.0 {
            return Err(crate::input::InputError::whole(
                &bare.source.file,
                format!("no link that moves has a mass (missing on {})", bare.without_inertia().join(", ")),
                "give every link an <inertial> with <mass> and <inertia>; a URDF made for display only has none",
            )
            .into());
        }
        let lumps = match &self.posture.lumps {
            None => usual_joints(&bare, link).map_err(|no| format!("{no}; name them with --lumps")),
            Some(chosen) => Ok(self.lump_joints(&bare, chosen)?),
        };
        Ok(Case {
            setting: Setting::new(&bare, &contact, self.hit.orientation, tool.as_ref()),
            iso_kg: iso_estimate_kg(&bare, load_kg),
            moving_mass_kg: bare.moving_mass_kg(),
            without_inertia: bare.without_inertia().into_iter().map(str::to_owned).collect(),
            robot: tool.map_or_else(|| bare.clone(), |tool| tool.mounted_on(&bare)),
            contact,
            orientation: self.hit.orientation,
            load_kg,
            lumps,
        })
    }

    fn lump_joints(&self, robot: &Robot, chosen: &[String]) -> miette::Result<[usize; 3]> {
        let find = |name: &String| {
            robot
                .joints
                .iter()
                .position(|joint| joint.name == *name && joint.motion != Motion::Fixed)
                .ok_or_else(|| miette::miette!("--lumps: {} has no joint `{name}` that moves", robot.name))
        };
        let joints = chosen.iter().map(find).collect::<miette::Result<Vec<_>>>()?;
        <[usize; 3]>::try_from(joints).map_err(|joints| {
            miette::miette!("--lumps names {} joints; three are needed, at shoulder, elbow and wrist", joints.len())
        })
    }

    fn one(&self, case: &Case, duration: Option<Duration>) -> miette::Result<()> {
        let mut given = self.posture.joints.clone().unwrap_or(Given::Named(Vec::new()));
        if self.posture.degrees {
            in_radians(&mut given, case);
        }
        let posture = Posture::new(&case.robot, case.contact.link, &given)?;
        let assessed = assess(&case.robot, &posture, &case.contact);
        let Some(mass) = assessed.mass_kg(case.orientation) else {
            return Err(case.immovable(&assessed));
        };
        let sent = self.sent.bus.as_ref().map(|bus| {
            let rate = self.sent.rate.unwrap_or(RATE_HZ);
            let instants = (0u32..).map(|n| f64::from(n) / rate);
            let instants = instants.take_while(|time| duration.is_none_or(|end| *time <= end.as_secs_f64()));
            self.send(bus, instants.map(|time| (time, Some(mass))))
        });
        let sent = sent.transpose()?;
        let answer = Answer {
            value: StatedMass::new(
                &case.robot,
                &posture,
                case.setting.clone(),
                mass,
                &assessed.point_m,
                &assessed.direction,
            ),
            beside: case.beside(&posture, &assessed),
            rank: assessed.rank,
            free_joints: posture.free.len(),
            without_inertia: case.without_inertia.clone(),
            warnings: case.warnings(&assessed),
            sent,
        };
        self.json.write(&answer)?;
        if !self.json.owns_stdout() {
            print_one(&answer);
        }
        Ok(())
    }

    fn motion(&self, case: &Case, path: &std::path::Path, duration: Option<Duration>) -> miette::Result<()> {
        let recording = recording::read(path)?;
        let trajectory = Trajectory::new(&recording, &case.robot, case.contact.link)
            .wrap_err_with(|| format!("{} is no motion of {}", path.display(), case.robot.name))?;
        let own = trajectory.times_s();
        let (first, last) = (own[0], own[own.len() - 1]);
        let rate = self.sent.rate.or(self.sent.bus.is_some().then_some(RATE_HZ));
        let end = duration.map_or(last, |duration| last.min(first + duration.as_secs_f64()));
        let times: Vec<f64> = match rate {
            None => own.to_vec(),
            // The end belongs to it, but for rounding.
            Some(rate) => {
                (0u32..).map(|n| first + f64::from(n) / rate).take_while(|time| *time <= end + 1e-9).collect()
            }
        };
        let mut warnings: Vec<String> = Vec::new();
        let mut samples = Vec::with_capacity(times.len());
        for time_s in times {
            let posture = trajectory.posture_at(&case.robot, case.contact.link, time_s)?;
            let assessed = assess(&case.robot, &posture, &case.contact);
            for warning in case.warnings(&assessed) {
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
            samples.push(Sample {
                time_s,
                effective_mass_kg: assessed.mass_kg(case.orientation),
                point_in_base_m: assessed.point_m.into(),
                direction_in_base: assessed.direction.into_inner().into(),
                beside: case.beside(&posture, &assessed),
            });
        }
        let sent =
            self.sent.bus.as_ref().map(|bus| {
                self.send(bus, samples.iter().map(|sample| (sample.time_s - first, sample.effective_mass_kg)))
            });
        let sweep = Sweep {
            setting: case.setting.clone(),
            trajectory: path.display().to_string(),
            sent: sent.transpose()?,
            samples,
            without_inertia: case.without_inertia.clone(),
            warnings,
        };
        self.json.write(&sweep)?;
        if !self.json.owns_stdout() {
            print_sweep(&sweep);
        }
        Ok(())
    }

    /// Sends values at their times after now; ends early at Ctrl-C.
    fn send(&self, bus: &BusAddress, values: impl Iterator<Item = (f64, Option<f64>)>) -> miette::Result<Sent> {
        interrupt::catch();
        let mut client = Client::open(bus)?;
        let name = client.line().describe();
        let progress = searching(&name);
        let node = client.the_sensor(self.sent.node)?.node;
        let before = Received::read(&mut client, node)?;
        let mut sender = Sender::start(&mut client, node)?;
        let mut left_out = 0;
        for (after, mass) in values {
            if interrupt::asked() {
                break;
            }
            let Some(mass) = mass.filter(|mass| is_sendable(*mass)) else {
                left_out += 1;
                continue;
            };
            sender.send_at(&mut client, Duration::try_from_secs_f64(after).into_diagnostic()?, mass)?;
            progress.set_message(format!("{mass:.2} kg to node {node}, {} frames", sender.sent()));
        }
        let received = Received::read(&mut client, node)?.since(before);
        progress.finish_and_clear();
        if received.taken == 0 && sender.sent() > 0 {
            miette::bail!(
                help = "it takes masses while it is Operational (armed) only; `thud monitor` arms it",
                "node {node} took none of the {} values that were sent",
                sender.sent()
            );
        }
        Ok(Sent { bus: name, node, frames: sender.sent(), left_out, sensor: received })
    }
}

impl Case {
    fn beside(&self, posture: &Posture, assessed: &Assessed) -> Beside {
        let lumps = self
            .lumps
            .clone()
            .and_then(|joints| lumped(&self.robot, posture, &self.contact, joints).map_err(|no| no.to_string()));
        let (lumped, lumped_missing) = match lumps {
            Ok(lumps) => {
                let [shoulder_kg, elbow_kg, wrist_kg, end_effector_kg] = lumps.lumps_kg;
                let joints = lumps.joints.map(|joint| self.robot.joints[joint].name.clone());
                let mass_kg = lumps.mass_kg;
                (Some(Lumps { mass_kg, shoulder_kg, elbow_kg, wrist_kg, end_effector_kg, joints }), None)
            }
            Err(why) => (None, Some(why)),
        };
        Beside {
            free_kg: assessed.free_kg,
            held_kg: assessed.held_kg,
            held_yielding_kg: assessed.held_yielding_kg,
            iso_kg: self.iso_kg,
            moving_mass_kg: self.moving_mass_kg,
            load_kg: self.load_kg,
            lumped,
            lumped_missing,
        }
    }

    fn warnings(&self, assessed: &Assessed) -> Vec<String> {
        let mut warnings = self.robot.warnings.clone();
        for &joint in &assessed.massless {
            let joint = &self.robot.joints[joint];
            warnings.push(format!(
                "joint {} moves the contact point in this direction, and what it carries has no inertia: it is taken as standing \
                 still; give link {} its mass and inertia",
                joint.name, self.robot.links[joint.child].name
            ));
        }
        warnings
    }

    fn immovable(&self, assessed: &Assessed) -> miette::Report {
        let [x, y, z]: [f64; 3] = assessed.direction.into_inner().into();
        let link = &self.robot.links[self.contact.link].name;
        let held = if self.orientation == Orientation::Free { "" } else { " with what is held" };
        miette::miette!(
            help = "the arm is straight, or at the edge of what it can do, along this direction: nothing gives way there but the \
                    ground. Choose another direction or posture, or hold less (--orientation free)",
            "no joint moves the contact point on {link} along {x:.3}, {y:.3}, {z:.3} of the base{held}: its effective mass is infinite"
        )
    }
}

/// Angles were given in degrees; ways stay metres.
fn in_radians(given: &mut Given, case: &Case) {
    let turns = |joint: usize| case.robot.joints[joint].motion == Motion::Turn;
    match given {
        Given::Named(values) => {
            for (name, value) in values {
                let joint = case.robot.joints.iter().position(|joint| joint.name == *name);
                if joint.is_some_and(turns) {
                    *value = value.to_radians();
                }
            }
        }
        Given::InOrder(values) => {
            // The same choice as a posture makes: all joints, or those on the way.
            let movable = case.robot.movable();
            let way = case.robot.way_to(case.contact.link);
            let joints: Vec<usize> = if values.len() == movable.len() {
                movable
            } else {
                way.into_iter().filter(|joint| movable.contains(joint)).collect()
            };
            for (value, joint) in values.iter_mut().zip(joints) {
                if turns(joint) {
                    *value = value.to_radians();
                }
            }
        }
    }
}

fn kg(mass: Option<f64>) -> String {
    mass.map_or_else(|| "infinite".to_owned(), |mass| format!("{mass:.3}"))
}

fn head(setting: &Setting) -> String {
    let [x, y, z] = setting.direction.map(|part| format!("{part:.3}"));
    let [a, b, c] = setting.point_m;
    let point = if setting.point_m == [0.0; 3] { String::new() } else { format!(" ({a}, {b}, {c} m)") };
    format!("{} at {}{point}, along {x}, {y}, {z} of the {}", setting.model.robot, setting.link, setting.frame.name())
}

fn print_one(answer: &Answer) {
    let Beside { free_kg, held_kg, held_yielding_kg, iso_kg, moving_mass_kg, load_kg, .. } = answer.beside;
    crate::say!("  {}: {:.3} kg\n", head(&answer.value.setting), answer.value.effective_mass_kg);
    let mut table = Table::new(&[("effective mass", Side::Left), ("kg", Side::Right), ("", Side::Left)]);
    let chosen = answer.value.setting.orientation;
    let mut row = |what: &str, mass: String, note: &str| table.row([what.to_owned(), mass, note.to_owned()]);
    let mark = |orientation: Orientation| if orientation == chosen { "◀" } else { "" };
    row("nothing held (equation 8)", kg(free_kg), mark(Orientation::Free));
    row("orientation held, may evade", kg(held_yielding_kg), mark(Orientation::HeldYielding));
    row("orientation and path held", kg(held_kg), mark(Orientation::Held));
    if let Some(lumps) = &answer.beside.lumped {
        let note = format!(
            "shoulder {:.1}, elbow {:.1}, wrist {:.1}, end {:.1} kg",
            lumps.shoulder_kg, lumps.elbow_kg, lumps.wrist_kg, lumps.end_effector_kg
        );
        row("four point masses", kg(lumps.mass_kg), &note);
    }
    row("ISO/TS 15066, M/2 + m_L", format!("{iso_kg:.3}"), &format!("M {moving_mass_kg:.2} kg, load {load_kg} kg"));
    crate::standard_output::say(format_args!("{table}"));
    notes(&answer.without_inertia, &answer.warnings);
    if let Some(why) = &answer.beside.lumped_missing {
        note(&format!("No model of point masses: {why}."));
    }
    if !answer.value.locked.is_empty() {
        let names: Vec<&str> = answer.value.locked.iter().map(|joint| joint.joint.as_str()).collect();
        note(&format!("Standing still, because no value was given: {}.", names.join(", ")));
    }
    let model = &answer.value.setting.model;
    note(&format!("Masses from {} (CRC-32 {}).", model.file, model.crc32));
    sent(answer.sent.as_ref());
}

fn note(words: &str) {
    let options = textwrap::Options::new(100).initial_indent("  ").subsequent_indent("  ");
    crate::say!("{}", textwrap::fill(words, &options));
}

fn notes(without_inertia: &[String], warnings: &[String]) {
    crate::say!();
    if !without_inertia.is_empty() {
        note(&format!("No inertia in the description: {}.", without_inertia.join(", ")));
    }
    for warning in warnings {
        note(&format!("Careful: {warning}."));
    }
}

fn sent(sent: Option<&Sent>) {
    let Some(sent) = sent else { return };
    let mut words =
        format!("{} values sent to node {} on {}; it took {}", sent.frames, sent.node, sent.bus, sent.sensor.taken);
    if sent.sensor.refused > 0 {
        words += &format!(", REFUSED {}", sent.sensor.refused);
    }
    if sent.sensor.missed > 0 {
        words += &format!(", MISSED {}", sent.sensor.missed);
    }
    if sent.left_out > 0 {
        words += &format!("; {} left out, where there was no value that it takes", sent.left_out);
    }
    note(&(words + "."));
}

/// Rows of a motion that are shown; all of them are in the JSON.
const SHOWN: usize = 12;

fn print_sweep(sweep: &Sweep) {
    crate::say!("  {}, {} instants of {}\n", head(&sweep.setting), sweep.samples.len(), sweep.trajectory);
    let mut table = Table::new(&[
        ("time s", Side::Right),
        ("effective mass kg", Side::Right),
        ("free", Side::Right),
        ("held", Side::Right),
        ("lumped", Side::Right),
    ]);
    // Evenly, first and last among them.
    let last = sweep.samples.len() - 1;
    let rows = SHOWN.min(sweep.samples.len());
    for row in 0..rows {
        let sample = &sweep.samples[row * last / (rows - 1).max(1)];
        table.row([
            format!("{:.3}", sample.time_s),
            kg(sample.effective_mass_kg),
            kg(sample.beside.free_kg),
            kg(sample.beside.held_kg),
            sample.beside.lumped.as_ref().map_or_else(String::new, |lumps| kg(lumps.mass_kg)),
        ]);
    }
    crate::standard_output::say(format_args!("{table}"));
    let masses = sweep.samples.iter().filter_map(|sample| Some((sample.effective_mass_kg?, sample.time_s)));
    let lightest = masses.clone().min_by(|one, other| one.0.total_cmp(&other.0));
    let heaviest = masses.max_by(|one, other| one.0.total_cmp(&other.0));
    notes(&sweep.without_inertia, &sweep.warnings);
    if let (Some((least, when)), Some((most, then))) = (lightest, heaviest) {
        note(&format!("{least:.3} kg at {when:.3} s to {most:.3} kg at {then:.3} s."));
    }
    if sweep.samples.len() > SHOWN {
        note("Every instant is in the JSON (--json FILE).");
    }
    sent(sweep.sent.as_ref());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_in_order_or_by_name() {
        assert_eq!(given("1, -2.5,3e-1").unwrap(), Given::InOrder(vec![1.0, -2.5, 0.3]));
        assert_eq!(given("A1=-1,A2 = 2").unwrap(), Given::Named(vec![("A1".to_owned(), -1.0), ("A2".to_owned(), 2.0)]));
        assert!(given("A1=1,2").unwrap_err().contains("`2` is not NAME=VALUE"));
        assert!(given("1,x").unwrap_err().contains("`x` is no number"));
        assert!(triple("1,2").unwrap_err().contains("three numbers are needed"));
        assert!(triple("1,inf,2").is_err());
        assert_eq!(six("1,2,3").unwrap(), [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]);
        assert!(six("1,2,3,4").is_err());
    }
}
