//! A checksum at the end of what a program keeps for itself, by which it sees that a damaged disk or a hand has changed it.

/// Bytes of the checksum.
const LENGTH: usize = 4;

/// The bytes with their checksum (CRC-32) behind them.
///
/// ```
/// use shared_mem::checksum::{with_checksum, without_checksum};
///
/// let mut kept = with_checksum(b"deviance 12.5".to_vec());
/// assert_eq!(without_checksum(&kept), Some(&b"deviance 12.5"[..]));
/// kept[3] ^= 1;
/// assert_eq!(without_checksum(&kept), None, "one changed bit is enough");
/// ```
pub fn with_checksum(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = crc32fast::hash(&bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}

/// What stands before the checksum; `None` where it is another one's.
pub fn without_checksum(bytes: &[u8]) -> Option<&[u8]> {
    let (content, sum) = bytes.split_at_checked(bytes.len().checked_sub(LENGTH)?)?;
    (crc32fast::hash(content).to_le_bytes() == sum).then_some(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bit_that_flipped_and_an_end_that_is_missing_are_seen() {
        let whole = with_checksum(b"what was kept".to_vec());
        assert_eq!(without_checksum(&whole), Some(&b"what was kept"[..]));
        for bit in 0..8 * whole.len() {
            let mut flipped = whole.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(without_checksum(&flipped), None);
        }
        assert!((0..whole.len()).all(|length| without_checksum(&whole[..length]).is_none()));
    }
}
