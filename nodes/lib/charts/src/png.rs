//! SVG to PNG, in the light colours of the style sheet, with fonts that come with the program.

use std::sync::{Arc, OnceLock};

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

use crate::ChartsError;
use crate::style::{CHARTS, STYLE};

/// Least width of a picture, pixels.
const LEAST_PX: u32 = 16;
/// Largest width and height, pixels: 256 MiB of RGBA.
const MOST_PX: u32 = 8192;
const FAMILY: &str = "DejaVu Sans";

/// An `svg` element of this crate as PNG, so many pixels wide, on the page's light ground.
///
/// # Errors
/// A width that is not between 16 and 8192, or a height beyond 8192 that follows from it; text that
/// is no SVG picture.
pub fn png(svg: &str, width_px: u32) -> Result<Vec<u8>, ChartsError> {
    let bad_width = ChartsError::Width {
        width_px,
        least: LEAST_PX,
        most: MOST_PX,
    };
    if !(LEAST_PX..=MOST_PX).contains(&width_px) {
        return Err(bad_width);
    }
    let tree = Tree::from_str(svg, &options()).map_err(|error| ChartsError::NotSvg {
        reason: error.to_string(),
    })?;
    let scale = width_px as f32 / tree.size().width();
    let height_px = (tree.size().height() * scale).round().max(1.0);
    if height_px > MOST_PX as f32 {
        return Err(bad_width);
    }
    let height_px = height_px as u32;
    let mut pixels = Pixmap::new(width_px, height_px).ok_or(bad_width)?;
    pixels.fill(Color::WHITE);
    resvg::render(
        &tree,
        Transform::from_scale(scale, scale),
        &mut pixels.as_mut(),
    );
    pixels.encode_png().map_err(|error| ChartsError::Encode {
        width: width_px,
        height: height_px,
        reason: error.to_string(),
    })
}

fn options() -> Options<'static> {
    static FONTS: OnceLock<Arc<fontdb::Database>> = OnceLock::new();
    static SHEET: OnceLock<String> = OnceLock::new();
    let fonts = FONTS.get_or_init(|| {
        let mut fonts = fontdb::Database::new();
        for face in [
            dejavu::sans_condensed::regular(),
            dejavu::sans_condensed::bold(),
        ] {
            fonts.load_font_source(fontdb::Source::Binary(Arc::new(face)));
        }
        Arc::new(fonts)
    });
    Options {
        fontdb: Arc::clone(fonts),
        font_family: FAMILY.to_owned(),
        style_sheet: Some(SHEET.get_or_init(|| light_sheet(&[STYLE, CHARTS])).clone()),
        ..Options::default()
    }
}

/// The rules for pictures, with the light theme's colours in the place of variables, which the
/// renderer does not know.
fn light_sheet(sheets: &[&str]) -> String {
    let mut colours: Vec<(String, &str)> = Vec::new();
    let mut rules = String::new();
    // The first block of each sheet names the light colours; a later one, within a media query, the
    // dark.
    for sheet in sheets {
        let block = sheet
            .strip_prefix(":root {")
            .and_then(|rest| rest.split_once('}'))
            .map_or("", |(block, _)| block);
        colours.extend(
            block
                .split(';')
                .filter_map(|pair| pair.split_once(':'))
                .map(|(name, value)| (name.trim().to_owned(), value.trim())),
        );
        for rule in sheet
            .lines()
            .flat_map(|line| line.split_inclusive('}'))
            .filter(|rule| rule.trim_start().starts_with("svg"))
        {
            rules.push_str(rule.trim_start());
        }
    }
    for (name, value) in colours {
        rules = rules.replace(&format!("var({name})"), value);
    }
    rules + &format!("svg {{ font-family: \"{FAMILY}\"; font-stretch: condensed; }}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variable_of_the_pictures_has_a_colour() {
        let sheet = light_sheet(&[STYLE, CHARTS]);
        assert!(!sheet.contains("var("), "{sheet}");
        for colour in [
            "svg .c0 { color: #0072b2; }",
            "svg .before { stroke: #d1590c; }",
            "svg text { fill: #5c6470; }",
        ] {
            assert!(sheet.contains(colour), "{colour} in {sheet}");
        }
    }
}
