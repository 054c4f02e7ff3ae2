//! CDR, the encoding of ROS 2 messages (OMG DDS-XTypes, plain CDR version 1): numbers aligned to their own size after a header of four bytes,
//! text and lists with their length before them.

/// Length of the header \[bytes\].
const HEADER: usize = 4;

/// Reads a message.
pub(super) struct Reader<'a> {
    body: &'a [u8],
    at: usize,
    little_endian: bool,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self, String> {
        let (header, body) = bytes.split_at_checked(HEADER).ok_or("it ends within its header")?;
        let little_endian = match header {
            [0, 0, ..] => false,
            [0, 1, ..] => true,
            _ => return Err(format!("its encoding is {:?}, not plain CDR", &header[..2])),
        };
        Ok(Self { body, at: 0, little_endian })
    }

    pub(super) fn bytes(&mut self, n: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(n).filter(|end| *end <= self.body.len());
        let end = end.ok_or_else(|| format!("it ends before {n} bytes at {}", self.at))?;
        let bytes = &self.body[self.at..end];
        self.at = end;
        Ok(bytes)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes: [u8; N] = self.bytes(N)?.try_into().map_err(|_| "it ends within a number")?;
        if !self.little_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub(super) fn u8(&mut self) -> Result<u8, String> {
        Ok(self.number::<1>()?[0])
    }

    pub(super) fn u32(&mut self) -> Result<u32, String> {
        self.number().map(u32::from_le_bytes)
    }

    pub(super) fn i32(&mut self) -> Result<i32, String> {
        self.number().map(i32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Result<f64, String> {
        self.number().map(f64::from_le_bytes)
    }

    /// Text, without the zero byte at its end.
    pub(super) fn text(&mut self) -> Result<String, String> {
        let length = self.u32()? as usize;
        let bytes = self.bytes(length)?;
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        String::from_utf8(text.to_vec()).map_err(|_| "a text is not in UTF-8".to_owned())
    }
}

/// Writes a message.
pub(super) struct Writer {
    body: Vec<u8>,
}

impl Writer {
    pub(super) fn new() -> Self {
        Self { body: Vec::new() }
    }

    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        self.body.resize(self.body.len().next_multiple_of(N), 0);
        self.body.extend(bytes);
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.number(value.to_le_bytes());
    }

    pub(super) fn i32(&mut self, value: i32) {
        self.number(value.to_le_bytes());
    }

    pub(super) fn f64s(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.number(value.to_le_bytes()));
    }

    pub(super) fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.body.extend(text.as_bytes());
        self.body.push(0);
    }

    #[cfg(test)]
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.body.extend(bytes);
    }

    /// The message with its header.
    pub(super) fn finish(self) -> Vec<u8> {
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend(self.body);
        bytes
    }
}
