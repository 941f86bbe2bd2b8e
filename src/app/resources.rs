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

/// Memory that this process may still ask for, in bytes: that of the machine, or what a limit on its address space
/// leaves of it; `None` where unknown. Other processes are not asked.
#[cfg(target_os = "linux")]
pub(super) fn memory_left() -> Option<u64> {
    use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
    use nix::unistd::{SysconfVar, sysconf};

    let value = |name| {
        sysconf(name)
            .ok()
            .flatten()
            .and_then(|n| u64::try_from(n).ok())
    };
    let page = value(SysconfVar::PAGE_SIZE)?;
    let memory = value(SysconfVar::_PHYS_PAGES)?.checked_mul(page)?;
    let (limit, _) = getrlimit(Resource::RLIMIT_AS).ok()?;
    if limit == RLIM_INFINITY {
        return Some(memory);
    }
    // The first number is the address space in pages.
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    let taken = statm.split(' ').next()?.parse::<u64>().ok()? * page;
    Some(memory.min(limit.saturating_sub(taken)))
}

/// Memory that this process may still ask for, in bytes; `None` where unknown.
#[cfg(not(target_os = "linux"))]
pub(super) fn memory_left() -> Option<u64> {
    None
}
