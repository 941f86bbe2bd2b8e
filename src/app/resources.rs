//! What the process has used, and what the machine has.

/// Processor seconds of all threads, in the program and in the system on its behalf; `None` where unknown.
pub(super) fn cpu_seconds() -> Option<f64> {
    usage().map(|usage| usage.0)
}

/// Most memory held at once, in bytes; `None` where unknown.
pub(super) fn peak_memory() -> Option<u64> {
    usage().map(|usage| usage.1)
}

#[cfg(unix)]
fn usage() -> Option<(f64, u64)> {
    use nix::sys::resource::{UsageWho, getrusage};
    use nix::sys::time::TimeVal;

    let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
    let seconds = |time: TimeVal| time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6;
    // Apple's systems count bytes, the others kibibytes.
    let unit = if cfg!(target_vendor = "apple") {
        1
    } else {
        1024
    };
    let memory = u64::try_from(usage.max_rss()).ok()?.saturating_mul(unit);
    Some((
        seconds(usage.user_time()) + seconds(usage.system_time()),
        memory,
    ))
}

#[cfg(not(unix))]
fn usage() -> Option<(f64, u64)> {
    None
}

/// Memory that this process may still take, in bytes: what is left of the machine's, of what its control group may have,
/// of a limit on its address space, and of `most`; `None` where nothing is known. Other processes are not asked.
pub(super) fn memory_left(most: Option<u64>) -> Option<u64> {
    let taken = memory_taken().unwrap_or(0);
    let limits = [most, machine_memory(), control_group_limit()];
    let of_limits = limits.into_iter().flatten().min();
    let of_limits = of_limits.map(|limit| limit.saturating_sub(taken));
    [of_limits, address_space_left()]
        .into_iter()
        .flatten()
        .min()
}

/// A number of bytes, with one of the units K, M, G and T of 1024 each.
///
/// # Errors
/// One sentence.
pub(super) fn size(text: &str) -> Result<u64, String> {
    let refusal = || "a size is a number of bytes above 0, as in 500M or 4G".to_owned();
    let unit = text.find(|c: char| !c.is_ascii_digit() && c != '.');
    let (number, unit) = text.split_at(unit.unwrap_or(text.len()));
    let shift = match unit.to_ascii_uppercase().as_str() {
        "" | "B" => 0,
        "K" | "KB" | "KIB" => 10,
        "M" | "MB" | "MIB" => 20,
        "G" | "GB" | "GIB" => 30,
        "T" | "TB" | "TIB" => 40,
        _ => return Err(refusal()),
    };
    let bytes = number.parse::<f64>().map_err(|_| refusal())? * f64::from(shift).exp2();
    if (1.0..1e18).contains(&bytes) {
        Ok(bytes as u64)
    } else {
        Err(refusal())
    }
}

#[cfg(target_os = "linux")]
fn machine_memory() -> Option<u64> {
    use nix::unistd::{SysconfVar, sysconf};

    let pages = sysconf(SysconfVar::_PHYS_PAGES).ok()??;
    u64::try_from(pages).ok()?.checked_mul(page_size()?)
}

#[cfg(target_os = "linux")]
fn page_size() -> Option<u64> {
    use nix::unistd::{SysconfVar, sysconf};

    u64::try_from(sysconf(SysconfVar::PAGE_SIZE).ok()??).ok()
}

/// Bytes of memory, and of address space, that this process has.
#[cfg(target_os = "linux")]
fn own_sizes() -> Option<[u64; 2]> {
    // The address space and what of it is in memory, in pages.
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    let mut pages = statm.split(' ').map(|word| word.parse::<u64>().ok());
    let (space, resident) = (pages.next()??, pages.next()??);
    let page = page_size()?;
    Some([resident * page, space * page])
}

#[cfg(target_os = "linux")]
fn memory_taken() -> Option<u64> {
    own_sizes().map(|[resident, _]| resident)
}

#[cfg(target_os = "linux")]
fn address_space_left() -> Option<u64> {
    use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};

    let (limit, _) = getrlimit(Resource::RLIMIT_AS).ok()?;
    let [_, space] = own_sizes()?;
    (limit != RLIM_INFINITY).then(|| limit.saturating_sub(space))
}

/// The least limit of the control groups that this process is in, of version 1 or 2; read once.
#[cfg(target_os = "linux")]
fn control_group_limit() -> Option<u64> {
    static LIMIT: std::sync::OnceLock<Option<u64>> = std::sync::OnceLock::new();
    *LIMIT.get_or_init(|| {
        let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
        let limits = groups.lines().flat_map(limit_files);
        // "max" is no limit; version 1 writes a number beyond all memory.
        let limits =
            limits.filter_map(|file| std::fs::read_to_string(file).ok()?.trim().parse().ok());
        limits.min()
    })
}

/// The files that may hold limits of the group in a line of `/proc/self/cgroup`, and of those above it.
#[cfg(target_os = "linux")]
fn limit_files(line: &str) -> Vec<std::path::PathBuf> {
    let mut fields = line.splitn(3, ':').skip(1);
    let (Some(controllers), Some(group)) = (fields.next(), fields.next()) else {
        return Vec::new();
    };
    let (root, file) = match controllers {
        "" => ("/sys/fs/cgroup", "memory.max"),
        _ if controllers.split(',').any(|name| name == "memory") => {
            ("/sys/fs/cgroup/memory", "memory.limit_in_bytes")
        }
        _ => return Vec::new(),
    };
    // In a container the path may be that of the host: then only the root is there.
    let group = std::path::Path::new(group.trim_start_matches('/'));
    let groups = group
        .ancestors()
        .filter(|group| !group.to_string_lossy().contains(".."));
    groups
        .map(|group| std::path::Path::new(root).join(group).join(file))
        .collect()
}

#[cfg(not(target_os = "linux"))]
fn machine_memory() -> Option<u64> {
    None
}

#[cfg(not(target_os = "linux"))]
fn memory_taken() -> Option<u64> {
    None
}

#[cfg(not(target_os = "linux"))]
fn address_space_left() -> Option<u64> {
    None
}

#[cfg(not(target_os = "linux"))]
fn control_group_limit() -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        let right = [
            ("1", 1),
            ("4G", 4 << 30),
            ("1.5k", 1536),
            ("2MiB", 2 << 20),
            ("3tb", 3 << 40),
        ];
        for (text, bytes) in right {
            assert_eq!(size(text), Ok(bytes), "{text}");
        }
        for text in ["", "G", "0", "-1", "1X", "1e5", "nan", "99999999T", "1 G"] {
            assert!(size(text).is_err(), "{text}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_least_limit_counts() {
        let most = memory_left(Some(1)).expect("Linux tells");
        assert_eq!(most, 0, "this process has more than a byte");
        assert!(memory_left(None).is_some_and(|left| left > 1 << 20));
        let files = limit_files("0::/a/b");
        assert_eq!(files[0].to_str(), Some("/sys/fs/cgroup/a/b/memory.max"));
        assert_eq!(files.len(), 3);
        let files = limit_files("9:cpu,memory:/");
        let file = "/sys/fs/cgroup/memory/memory.limit_in_bytes";
        assert_eq!(files[0].to_str(), Some(file));
        assert!(limit_files("9:cpu:/").is_empty() && limit_files("9").is_empty());
    }
}
