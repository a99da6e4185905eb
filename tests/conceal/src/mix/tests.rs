use std::collections::HashMap;

use super::*;

#[test]
fn the_frozen_set_is_composed_as_promised() {
    let all = requests(Mix::Frozen, 1000, 9, 12);
    assert_eq!(all.len(), 1000);
    let count = |test: &dyn Fn(&Request) -> bool| all.iter().filter(|r| test(r)).count();
    assert!(count(&|r| r.way == Way::Absent) >= 300);
    assert!(count(&|r| r.effects.len() == 2) >= 150);
    assert!(count(&|r| r.way == Way::Conditional) >= 100);
    assert!(count(&|r| r.way == Way::Absorbed) >= 100);
    assert!(count(&|r| r.way == Way::Unlisted) >= 150);
    // Every effect of the list alone, at every strength.
    let mut strengths: HashMap<&str, Vec<f64>> = HashMap::new();
    for r in all.iter().filter(|r| r.way == Way::Unnamed && r.effects.len() == 1) {
        strengths.entry(r.effects[0].0.id).or_default().push(r.effects[0].1);
    }
    for effect in listed() {
        let drawn = &strengths[effect.id];
        assert!(drawn.len() >= 4, "{}: {drawn:?}", effect.id);
        if !WRONG_NUMBERS.contains(&effect.id) {
            for (low, high) in STRENGTHS {
                assert!(drawn.iter().any(|d| (low..=high).contains(d)), "{}: none in {low}..{high}", effect.id);
            }
        }
    }
}

#[test]
fn leaving_something_out_of_the_list_does_not_say_what_is_hidden() {
    let all = requests(Mix::Frozen, 1000, 2, 12);
    let mut decoys = 0;
    for r in &all {
        for (effect, _) in &r.effects {
            // What is hidden may be named, unless this case is to be beyond the list.
            let out = r.without.contains(&effect.id);
            assert_eq!(out, r.way == Way::Unlisted && effect.listed, "{r:?} without {:?}", r.without);
        }
        decoys += usize::from(r.way != Way::Unlisted && !r.without.is_empty());
    }
    let taken_out = all.iter().filter(|r| r.way == Way::Unlisted && !r.without.is_empty()).count();
    assert!(taken_out > 50 && decoys > 50, "{taken_out} and {decoys}");
    assert!(all.iter().filter(|r| r.way == Way::Absent).any(|r| !r.without.is_empty()));
}

#[test]
fn pairs_are_two_effects_that_fit_one_campaign() {
    for r in requests(Mix::Pairs, 150, 3, 12) {
        let [(a, da), (b, db)] = r.effects[..] else { panic!("{r:?} is no pair") };
        assert_ne!(a.id, b.id);
        assert!(da >= 25.0 && db >= 25.0);
        assert!(a.kinds.contains(&r.wish.kind) && b.kinds.contains(&r.wish.kind));
    }
}

#[test]
fn the_same_seed_gives_the_same_requests_and_another_seed_others() {
    let seeds = |seed| requests(Mix::Frozen, 50, seed, 12).iter().map(|r| r.seed).collect::<Vec<_>>();
    assert_eq!(seeds(4), seeds(4));
    assert_ne!(seeds(4), seeds(5));
}

#[test]
fn there_are_thirty_listed_effects_and_at_least_six_others() {
    assert_eq!(listed().count(), 30);
    assert!(effect::ALL.iter().filter(|e| !e.listed).count() >= 6);
    for (a, b) in effect::TWINS {
        assert!(effect::named(a).is_some_and(|e| e.listed) && effect::named(b).is_some_and(|e| e.listed));
    }
}
