use super::*;

#[test]
fn noise_has_its_rms_and_whitening_undoes_its_colour() {
    for seed in 0..5 {
        let mut draw = Draw::new(seed);
        let colour = Colour::draw(&mut draw, 0.3);
        let mut noise = colour.sample(&mut draw, 200_000);
        let rms = (noise.iter().map(|v| v * v).sum::<f64>() / noise.len() as f64).sqrt();
        assert!((rms / 0.3 - 1.0).abs() < 0.03, "{rms}");
        colour.whiten(&mut noise);
        let variance = noise.iter().map(|v| v * v).sum::<f64>() / noise.len() as f64;
        assert!((variance - 1.0).abs() < 0.03, "{variance}");
        for lag in 1..4 {
            let product: f64 = noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b).sum();
            assert!((product / noise.len() as f64).abs() < 0.01);
        }
    }
}
