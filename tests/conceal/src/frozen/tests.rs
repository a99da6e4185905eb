use std::collections::HashMap;

use super::*;
use crate::case;

fn kept() -> Vec<&'static str> {
    LIST.lines().filter(|line| !line.starts_with('#')).collect()
}

/// What is asked for is compared in all cases; what is drawn, which takes a second each, in ten.
#[test]
fn the_list_is_what_the_seed_draws() {
    let requests = requests();
    let kept = kept();
    assert_eq!(kept.len(), CASES, "`thud-conceal frozen > tests/conceal/frozen.txt` writes the list anew");
    for (index, request) in requests.iter().enumerate() {
        let wanted = line(index, request, "");
        assert!(kept[index].starts_with(&wanted), "listed: {}; drawn: {wanted}", kept[index]);
    }
    for index in sample(&requests, 10) {
        assert!(!kept[index].ends_with(NO_DIGEST), "case {} has no digest", index + 1);
        let digest = digest(&case::make(&requests[index]));
        assert_eq!(kept[index], line(index, &requests[index], &digest), "what case {} draws has changed", index + 1);
    }
}

#[test]
fn a_sample_holds_every_way_and_grows_into_the_whole() {
    let requests = requests();
    for count in [12, 20, 100] {
        let chosen = sample(&requests, count);
        assert_eq!(chosen.len(), count);
        let mut ways: HashMap<usize, usize> = HashMap::new();
        for index in &chosen {
            *ways.entry(stratum(&requests[*index])).or_default() += 1;
        }
        assert_eq!(ways.len(), STRATA, "{count}: {ways:?}");
    }
    assert_eq!(sample(&requests, CASES), (0..CASES).collect::<Vec<_>>());
}
