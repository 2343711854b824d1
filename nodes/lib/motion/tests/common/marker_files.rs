//! Writes marker clips as C3D and TRC.

use std::fmt::Write;

use cromosim_motion::MarkerClip;

/// How a C3D file's numbers are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    IntelFloat,
    IntelInteger,
    DecFloat,
    DecInteger,
    MipsFloat,
    MipsInteger,
}

impl Kind {
    pub fn is_integer(self) -> bool {
        matches!(
            self,
            Self::IntelInteger | Self::DecInteger | Self::MipsInteger
        )
    }

    fn word(self, value: i16) -> [u8; 2] {
        if matches!(self, Self::MipsFloat | Self::MipsInteger) {
            value.to_be_bytes()
        } else {
            value.to_le_bytes()
        }
    }

    fn float(self, value: f32) -> [u8; 4] {
        match self {
            Self::IntelFloat | Self::IntelInteger => value.to_le_bytes(),
            Self::MipsFloat | Self::MipsInteger => value.to_be_bytes(),
            Self::DecFloat | Self::DecInteger => {
                let [a, b, c, d] = (value * 4.0).to_le_bytes();
                [c, d, a, b]
            }
        }
    }
}

struct Writer {
    kind: Kind,
    section: Vec<u8>,
}

impl Writer {
    fn group(&mut self, id: i8, name: &str) {
        self.section.extend([name.len() as u8, (-id) as u8]);
        self.section.extend(name.bytes());
        self.section.extend(self.kind.word(3));
        self.section.push(0);
    }

    fn parameter(&mut self, id: i8, name: &str, kind: i8, dimensions: &[u8], values: &[u8]) {
        self.section.extend([name.len() as u8, id as u8]);
        self.section.extend(name.bytes());
        self.section.extend(
            self.kind
                .word((2 + 2 + dimensions.len() + values.len() + 1) as i16),
        );
        self.section.extend([kind as u8, dimensions.len() as u8]);
        self.section.extend(dimensions);
        self.section.extend(values);
        self.section.push(0);
    }

    fn words(&mut self, id: i8, name: &str, values: &[u16]) {
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|&value| self.kind.word(value as i16))
            .collect();
        let dimensions = [values.len() as u8];
        self.parameter(
            id,
            name,
            2,
            if values.len() == 1 { &[] } else { &dimensions },
            &bytes,
        );
    }

    fn float(&mut self, id: i8, name: &str, value: f32) {
        let bytes = self.kind.float(value);
        self.parameter(id, name, 4, &[], &bytes);
    }

    fn strings(&mut self, id: i8, name: &str, values: &[String]) {
        let width = values.iter().map(String::len).max().unwrap();
        let text: String = values
            .iter()
            .map(|value| format!("{value:width$}"))
            .collect();
        self.parameter(
            id,
            name,
            -1,
            &[width as u8, values.len() as u8],
            text.as_bytes(),
        );
    }
}

const INTEGER_SCALE: f64 = 0.1;

/// The clip in millimetres, with `analog` samples in every frame.
pub fn c3d(clip: &MarkerClip, kind: Kind, analog: usize) -> Vec<u8> {
    let frames = clip.frames.len();
    let scale = if kind.is_integer() {
        INTEGER_SCALE
    } else {
        -1.0
    } as f32;
    let mut writer = Writer {
        kind,
        section: vec![
            1,
            0x50,
            0,
            84 + [Kind::DecFloat, Kind::DecInteger].contains(&kind) as u8,
        ],
    };
    if matches!(kind, Kind::MipsFloat | Kind::MipsInteger) {
        writer.section[3] = 86;
    }
    let counted = frames.min(65_535) as u16;
    // The section's length must be known for DATA_START: written twice.
    let mut data_block = 0_u16;
    for _ in 0..2 {
        writer.section.truncate(4);
        writer.group(1, "POINT");
        writer.words(1, "USED", &[clip.labels.len() as u16]);
        writer.float(1, "SCALE", scale);
        writer.float(1, "RATE", clip.rate_hz as f32);
        writer.words(1, "FRAMES", &[counted]);
        writer.words(1, "DATA_START", &[data_block]);
        writer.strings(1, "UNITS", &["mm".to_owned()]);
        for (part, labels) in clip.labels.chunks(255).enumerate() {
            writer.strings(
                1,
                &if part == 0 {
                    "LABELS".to_owned()
                } else {
                    format!("LABELS{}", part + 1)
                },
                labels,
            );
        }
        writer.group(2, "TRIAL");
        writer.words(2, "ACTUAL_START_FIELD", &[1, 0]);
        writer.words(
            2,
            "ACTUAL_END_FIELD",
            &[frames as u16, (frames >> 16) as u16],
        );
        writer.section.extend([0, 0]);
        data_block = (writer.section.len().div_ceil(512) + 2) as u16;
    }
    writer.section[2] = writer.section.len().div_ceil(512) as u8;
    let mut bytes = vec![2, 0x50];
    for value in [clip.labels.len() as u16, analog as u16, 1, counted, 0] {
        bytes.extend(kind.word(value as i16));
    }
    bytes.extend(kind.float(scale));
    bytes.extend(kind.word(data_block as i16));
    bytes.extend(kind.word(analog as i16));
    bytes.extend(kind.float(clip.rate_hz as f32));
    bytes.resize(512, 0);
    bytes.extend(&writer.section);
    bytes.resize((data_block as usize - 1) * 512, 0);
    for frame in &clip.frames {
        for point in frame {
            let place = point.map_or([0.0; 3], |point| (point * 1000.0).coords.into());
            let seen = if point.is_some() { 1.0 } else { -1.0 };
            for value in place {
                match kind.is_integer() {
                    true => bytes.extend(kind.word((value / INTEGER_SCALE).round() as i16)),
                    false => bytes.extend(kind.float(value as f32)),
                }
            }
            match kind.is_integer() {
                true => bytes.extend(kind.word(seen as i16)),
                false => bytes.extend(kind.float(seen)),
            }
        }
        bytes.extend(std::iter::repeat_n(
            7,
            analog * if kind.is_integer() { 2 } else { 4 },
        ));
    }
    bytes.resize(bytes.len().next_multiple_of(512), 0);
    bytes
}

/// The clip in millimetres.
pub fn trc(clip: &MarkerClip) -> String {
    let (frames, markers, rate) = (clip.frames.len(), clip.labels.len(), clip.rate_hz);
    let mut text = "PathFileType\t4\t(X/Y/Z)\tmade.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n".to_owned();
    writeln!(
        text,
        "{rate:.3}\t{rate:.3}\t{frames}\t{markers}\tmm\t{rate:.3}\t1\t{frames}"
    )
    .unwrap();
    writeln!(text, "Frame#\tTime\t{}", clip.labels.join("\t\t\t")).unwrap();
    let axes: Vec<String> = (1..=markers)
        .map(|number| format!("X{number}\tY{number}\tZ{number}"))
        .collect();
    writeln!(text, "\t\t{}\n", axes.join("\t")).unwrap();
    for (index, frame) in clip.frames.iter().enumerate() {
        let cells: Vec<String> = frame
            .iter()
            .map(|point| {
                point.map_or("\t\t".to_owned(), |p| {
                    format!("{:.5}\t{:.5}\t{:.5}", 1e3 * p.x, 1e3 * p.y, 1e3 * p.z)
                })
            })
            .collect();
        writeln!(
            text,
            "{}\t{:.5}\t{}",
            index + 1,
            index as f64 / rate,
            cells.join("\t")
        )
        .unwrap();
    }
    text
}
