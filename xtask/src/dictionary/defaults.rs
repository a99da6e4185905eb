//! What each object holds after power-up, asked from the dictionary itself.

use std::sync::OnceLock;

use thud_firmware::board::{Identity, ResetCause};
use thud_firmware::capture::Captures;
use thud_firmware::configuration::NodeSettings;
use thud_firmware::dictionary::access::{NodeObjects, View};
use thud_firmware::dictionary::index;
use thud_firmware::dictionary::object::Sub;
use thud_firmware::dictionary::value::Value;
use thud_firmware::shared::Shared;
use thud_firmware::storage::Loaded;
use zencan_common::objects::AccessType;

/// What an object holds in a sensor that nobody has configured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Default {
    /// The same in every sensor.
    Fixed(Value),
    /// This plus the node id.
    PerNode(u32),
}

impl std::fmt::Display for Default {
    /// As EDS files have it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Fixed(Value::F32(value)) => write!(f, "{value}"),
            Self::Fixed(Value::Text(text)) => f.write_str(text),
            Self::Fixed(Value::U8(value)) => write!(f, "{value}"),
            Self::Fixed(Value::U16(value)) => write!(f, "{value}"),
            Self::Fixed(Value::U32(value)) => write!(f, "0x{value:X}"),
            Self::Fixed(Value::U64(value)) => write!(f, "{value}"),
            Self::Fixed(Value::Bytes(..)) => Ok(()),
            Self::PerNode(base) => write!(f, "$NODEID+0x{base:X}"),
        }
    }
}

static CAPTURES: Captures<16> = Captures::new();

fn read(node_id: u8, object: u16, sub: u8) -> Option<Value> {
    static SHARED: OnceLock<Shared<16>> = OnceLock::new();
    let shared = SHARED.get_or_init(|| {
        let identity =
            Identity { serial: 0, hardware_revision: 0, build: 0, reset_cause: ResetCause::PowerOn, ended_at: 0 };
        Shared::new(identity, Loaded::Nothing, &CAPTURES)
    });
    let mut node =
        NodeObjects::new(NodeSettings { node_id, heartbeat_ms: shared.active().configuration.node.heartbeat_ms });
    View { shared, node: &mut node, now_ms: 0 }.value(object, sub).ok()
}

/// The default of a sub-object; `None` for what is measured or counted, and for what differs from device to device.
pub fn default(object: u16, sub: &Sub) -> Option<Default> {
    let of_the_device =
        matches!((object, sub.sub), (index::IDENTITY, 4) | (index::HARDWARE_VERSION | index::SOFTWARE_VERSION, _));
    let communication = (0x1000..0x1FFF).contains(&object) && object != index::ERROR_REGISTER;
    let settable = matches!(sub.access, AccessType::Rw | AccessType::Const);
    if of_the_device || object == index::ERROR_HISTORY && sub.sub > 0 || !(settable || communication) {
        return None;
    }
    // What moves with the node id is said to.
    match (read(1, object, sub.sub)?, read(2, object, sub.sub)?) {
        (Value::U32(one), Value::U32(two)) if one + 1 == two => Some(Default::PerNode(one - 1)),
        (one, two) if one == two => Some(Default::Fixed(one)),
        _ => None,
    }
}
