//! "Did you mean": the nearest of a set of known names.

use strsim::damerau_levenshtein;

/// Words longer than this are no typing errors, and the distance costs the product of the lengths.
const LONGEST: usize = 64;

/// The candidate that `word` is most likely a misspelling of; `None` when nothing is near.
///
/// Upper and lower case are one here. A third of the letters may differ; a word of three letters or more may also be
/// the start of a candidate (`int` for `integer`).
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if word.is_empty() || word.len() > LONGEST {
        return None;
    }
    let word = word.to_lowercase();
    let n_chars = word.chars().count();
    let near = candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= LONGEST)
        .filter_map(|candidate| {
            let known = candidate.to_lowercase();
            let distance = damerau_levenshtein(&word, &known);
            let starts = n_chars >= 3 && known.starts_with(&word);
            (3 * distance <= n_chars.max(3) || starts).then_some((distance, candidate))
        });
    near.min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::closest;

    const NAMES: [&str; 5] = ["integer", "float", "point3", "Shape", "roughness"];

    #[test]
    fn misspellings_find_their_name() {
        for (word, name) in [
            ("flaot", "float"),
            ("int", "integer"),
            ("shape", "Shape"),
            ("roughnes", "roughness"),
            ("Shap", "Shape"),
        ] {
            assert_eq!(closest(word, NAMES), Some(name), "{word}");
        }
    }

    #[test]
    fn distant_empty_and_endless_words_find_nothing() {
        assert_eq!(closest("matte", NAMES), None);
        assert_eq!(closest("", NAMES), None);
        assert_eq!(closest(&"f".repeat(1 << 20), NAMES), None);
    }
}
