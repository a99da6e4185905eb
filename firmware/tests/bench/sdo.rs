//! The master's side of SDO, from zencan-common's messages, with every step open to misbehaviour.

use thud_firmware::dictionary::index;
use zencan_common::sdo::{SdoRequest, SdoResponse};

use super::Master;

/// An abort code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abort(pub u32);

impl Master {
    async fn ask(&self, request: SdoRequest) -> Result<SdoResponse, Abort> {
        match SdoResponse::try_from(self.sdo(request.to_bytes()).await).expect("a response") {
            SdoResponse::Abort { abort_code, .. } => Err(Abort(abort_code)),
            response => Ok(response),
        }
    }

    /// Reads, expedited or by segments, with a pause before each segment.
    pub async fn read_slowly(&self, index: u16, sub: u8, pause_ms: u64) -> Result<Vec<u8>, Abort> {
        let SdoResponse::ConfirmUpload { n, e, s, data, .. } =
            self.ask(SdoRequest::initiate_upload(index, sub)).await?
        else {
            panic!("not an upload")
        };
        if e {
            return Ok(data[..4 - usize::from(n)].to_vec());
        }
        assert!(s, "the length is announced");
        let total = u32::from_le_bytes(data) as usize;
        let mut bytes = Vec::new();
        let mut toggle = false;
        loop {
            self.wait(pause_ms).await;
            let SdoResponse::UploadSegment { t, n, c, data } =
                self.ask(SdoRequest::upload_segment_request(toggle)).await?
            else {
                panic!("not a segment")
            };
            assert_eq!(t, toggle);
            toggle = !toggle;
            bytes.extend_from_slice(&data[..7 - usize::from(n)]);
            if c {
                assert_eq!(bytes.len(), total);
                return Ok(bytes);
            }
        }
    }

    pub async fn read(&self, index: u16, sub: u8) -> Result<Vec<u8>, Abort> {
        self.read_slowly(index, sub, 0).await
    }

    pub async fn read_u32(&self, index: u16, sub: u8) -> u32 {
        u32::from_le_bytes(self.read(index, sub).await.unwrap().try_into().unwrap())
    }

    pub async fn write(&self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), Abort> {
        self.ask(SdoRequest::expedited_download(index, sub, bytes)).await.map(drop)
    }

    pub async fn write_by_segments(&self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), Abort> {
        self.ask(SdoRequest::initiate_download(index, sub, Some(bytes.len() as u32))).await?;
        let last = bytes.chunks(7).len() - 1;
        for (number, piece) in bytes.chunks(7).enumerate() {
            self.ask(SdoRequest::download_segment(number % 2 == 1, number == last, piece)).await?;
        }
        Ok(())
    }

    pub async fn write_by_block(&self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), Abort> {
        self.ask(SdoRequest::initiate_block_download(index, sub, true, bytes.len() as u32)).await?;
        let last = bytes.chunks(7).len();
        for (number, piece) in (1..).zip(bytes.chunks(7)) {
            let mut frame = [0; 8];
            frame[0] = number | u8::from(usize::from(number) == last) << 7;
            frame[1..=piece.len()].copy_from_slice(piece);
            if usize::from(number) == last {
                let answer = SdoResponse::try_from(self.sdo(frame).await).unwrap();
                assert!(matches!(answer, SdoResponse::ConfirmBlock { ackseq, .. } if ackseq == number));
            } else {
                self.send(0x600 + u16::from(self.node), &frame);
            }
        }
        let crc = crc::Crc::<u16>::new(&crc::CRC_16_XMODEM).checksum(bytes);
        let empty = (7 - bytes.len() % 7) % 7;
        self.ask(SdoRequest::end_block_download(empty as u8, crc)).await.map(drop)
    }

    /// Reads by blocks of `size` segments.
    pub async fn read_by_blocks(&self, index: u16, sub: u8, size: u8) -> Result<Vec<u8>, Abort> {
        let request = SdoRequest::initiate_block_upload(index, sub, true, size, 0);
        let SdoResponse::ConfirmBlockUpload { sc: true, .. } = self.ask(request).await? else {
            panic!("not a block upload")
        };
        self.send(0x600 + u16::from(self.node), &SdoRequest::StartBlockUpload.to_bytes());
        let mut bytes = Vec::new();
        let mut complete = false;
        while !complete {
            // Frames of this block until the last one has come or none comes any more.
            let mut good = 0u8;
            let mut seen = 0u8;
            while seen < size && !complete {
                let Some(frame) = self.expect(0x580 + u16::from(self.node), 20).await else { break };
                if frame.data[0] == 0x80 {
                    return Err(Abort(u32::from_le_bytes(frame.data[4..].try_into().unwrap())));
                }
                seen = frame.data[0] & 0x7F;
                if seen == good + 1 {
                    good = seen;
                    bytes.extend_from_slice(&frame.data[1..]);
                    complete = frame.data[0] & 0x80 != 0;
                }
            }
            let confirm = SdoRequest::ConfirmBlock { ackseq: good, blksize: size };
            if complete {
                let SdoResponse::BlockUploadEnd { n, crc } = self.ask(confirm).await? else { panic!("not the end") };
                bytes.truncate(bytes.len() - usize::from(n));
                assert_eq!(crc, crc::Crc::<u16>::new(&crc::CRC_16_XMODEM).checksum(&bytes));
                self.send(0x600 + u16::from(self.node), &SdoRequest::EndBlockUpload.to_bytes());
            } else {
                self.send(0x600 + u16::from(self.node), &confirm.to_bytes());
            }
        }
        Ok(bytes)
    }

    /// The slot that holds this impact's curve.
    pub async fn slot_of(&self, impact: u32) -> u16 {
        for slot in [index::RECORDING, index::RECORDING + 1] {
            if self.read(slot, 1).await == Ok(vec![1]) && self.read_u32(slot, 2).await == impact {
                return slot;
            }
        }
        panic!("no slot holds impact {impact}")
    }
}
