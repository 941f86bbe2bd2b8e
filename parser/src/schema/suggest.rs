//! "Did you mean …": the nearest of a set of names.

/// The candidate nearest to `word`, if any is near enough to be what was meant: equal but for case, or at most one
/// edit (insertion, deletion, substitution, swap of neighbours) for every three characters. The first of equals.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Longer words are never typed by hand, and the distance takes time proportional to the product of the lengths.
    const LONGEST: usize = 64;
    let length = word.chars().count();
    if length == 0 || length > LONGEST {
        return None;
    }
    let lower = word.to_lowercase();
    let allowed = length.div_ceil(3);
    candidates
        .into_iter()
        .filter(|candidate| {
            candidate.chars().count().abs_diff(length) <= allowed && *candidate != word
        })
        .map(|candidate| {
            let folded = candidate.to_lowercase();
            // A difference in case counts less than any edit.
            (
                if folded == lower {
                    0
                } else {
                    strsim::osa_distance(&lower, &folded)
                },
                candidate,
            )
        })
        .filter(|(distance, candidate)| {
            *distance <= allowed && *distance < candidate.chars().count()
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// The help text of a diagnostic about an unknown name.
pub fn did_you_mean<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    nearest(word, candidates).map(|name| format!("did you mean \"{name}\"?"))
}

#[cfg(test)]
mod tests {
    use super::{did_you_mean, nearest};

    #[test]
    fn the_nearest_name_is_found_and_a_far_one_is_not() {
        let names = ["roughness", "uroughness", "Kd", "remaproughness"];
        assert_eq!(nearest("roughnes", names), Some("roughness"));
        assert_eq!(nearest("kd", names), Some("Kd"));
        assert_eq!(nearest("ruoghness", names), Some("roughness"));
        assert_eq!(nearest("temperature", names), None);
        assert_eq!(
            did_you_mean("Roughness", names).as_deref(),
            Some("did you mean \"roughness\"?")
        );
    }

    #[test]
    fn a_name_is_never_suggested_for_itself() {
        assert_eq!(nearest("Kd", ["Kd"]), None);
    }

    #[test]
    fn one_letter_names_are_not_suggested_for_other_letters() {
        assert_eq!(nearest("I", ["L"]), None);
        assert_eq!(nearest("l", ["L"]), Some("L"));
    }

    #[test]
    fn very_long_words_are_not_compared() {
        let word = "x".repeat(1 << 20);
        let other = "x".repeat((1 << 20) + 1);
        assert_eq!(nearest(&word, [other.as_str()]), None);
    }
}
