//! Check of free memory before a large allocation: an allocation that fails would end the process.

use std::fs::read_to_string;

use crate::SimulationError;

/// Largest allocation without a check \[bytes\]: the check costs more than it.
const LITTLE: u64 = 64 << 20;

/// Refuses what needs more bytes than this process can get: on Linux the least of what the system, the control group and the limit
/// of the address space leave. Elsewhere the allocation decides.
///
/// # Errors
/// [`SimulationError::Memory`].
pub fn require_memory(needed: u64) -> Result<(), SimulationError> {
    if needed <= LITTLE {
        return Ok(());
    }
    match available() {
        Some(available) if needed > available => Err(SimulationError::Memory {
            needed,
            available: Some(available),
        }),
        _ => Ok(()),
    }
}

/// Reserves memory for this many more numbers in a column.
///
/// # Errors
/// [`SimulationError::Memory`].
pub fn reserve_memory(column: &mut Vec<f64>, numbers: usize) -> Result<(), SimulationError> {
    let needed = (numbers as u64).saturating_mul(size_of::<f64>() as u64);
    require_memory(needed)?;
    let refused = |_| SimulationError::Memory {
        needed,
        available: None,
    };
    column.try_reserve_exact(numbers).map_err(refused)
}

/// Bytes that this process can still allocate, where the system states it.
fn available() -> Option<u64> {
    let free = read_to_string("/proc/meminfo").map(|table| kilobytes(&table, "MemAvailable:"));
    [free.ok().flatten(), address_space(), group()]
        .into_iter()
        .flatten()
        .min()
}

/// What `ulimit -v` leaves.
fn address_space() -> Option<u64> {
    let limits = read_to_string("/proc/self/limits").ok()?;
    let line = limits
        .lines()
        .find(|l| l.starts_with("Max address space"))?;
    let most: u64 = line.split_whitespace().nth(3)?.parse().ok()?;
    let taken = kilobytes(&read_to_string("/proc/self/status").ok()?, "VmSize:")?;
    Some(most.saturating_sub(taken))
}

/// The limit of the control group; what it uses is no subtrahend, for it counts caches that give way.
fn group() -> Option<u64> {
    let groups = read_to_string("/proc/self/cgroup").ok()?;
    let limit = |line: &str| -> Option<u64> {
        let (_, rest) = line.split_once(':')?;
        let (kinds, path) = rest.split_once(':')?;
        let (root, name) = match kinds {
            "" => ("/sys/fs/cgroup", "memory.max"),
            "memory" => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes"),
            _ => return None,
        };
        // In a container the path is that of the host, and the group is the root.
        let read = |path: &str| read_to_string(format!("{root}{path}/{name}"));
        read(path).or_else(|_| read("")).ok()?.trim().parse().ok()
    };
    groups.lines().filter_map(limit).min()
}

/// The number behind a name in a table of the kernel \[bytes\].
fn kilobytes(table: &str, name: &str) -> Option<u64> {
    let line = table.lines().find_map(|line| line.strip_prefix(name))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_there_is_is_refused_with_both_numbers() {
        assert_eq!(require_memory(LITTLE), Ok(()));
        let mut column = Vec::new();
        let refused = reserve_memory(&mut column, usize::MAX / 8).unwrap_err();
        let SimulationError::Memory { needed, .. } = refused else {
            panic!("{refused}");
        };
        assert_eq!(needed, (usize::MAX / 8 * 8) as u64);
        assert_eq!(column.capacity(), 0);
    }

    #[test]
    fn a_table_of_the_kernel_is_read() {
        let table = "MemTotal:       24 kB\nMemAvailable:    3 kB\n";
        assert_eq!(kilobytes(table, "MemAvailable:"), Some(3072));
        assert_eq!(kilobytes(table, "VmSize:"), None);
    }
}
