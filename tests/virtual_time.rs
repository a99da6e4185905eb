//! Virtual time that passes while the host listens.

use std::time::Duration;

use thud::client::Client;
use thud::client::watch::{Happening, Watch};

/// Lets time pass; what is heard meanwhile is kept by the client.
pub fn pass(client: &mut Client, span: Duration) {
    let until = client.line().now() + span;
    while client.line().now() < until {
        client.line().next(Duration::from_millis(100)).unwrap();
    }
}

/// Follows for a while.
pub fn follow(watch: &mut Watch, client: &mut Client, span: Duration) -> Vec<Happening> {
    let until = client.line().now() + span;
    let mut all = Vec::new();
    while client.line().now() < until {
        all.extend(watch.next(client, Duration::from_millis(20)).unwrap());
    }
    all
}
