#![allow(clippy::unwrap_used)]
//! Charts of made-up scores. `CROMOSIM_CHARTS=DIR cargo test -p cromosim_charts` keeps the pictures
//! and the page, to be looked at.

use super::*;

/// Errors of paths by channel, with intervals.
fn fidelity(paths: &[&str]) -> BarChart {
    let channels = [
        "accel x", "accel y", "accel z", "gyro x", "gyro y", "gyro z",
    ];
    let bar = |(path, name): (usize, &&str), channel: usize| {
        let value = (2.1 - 0.25 * path as f64) * (1.0 + 0.2 * (channel as f64 * 1.7).sin());
        Bar {
            series: (*name).to_owned(),
            value,
            interval: Some((0.93 * value, 1.08 * value)),
        }
    };
    let group = |(channel, label): (usize, &&str)| Group {
        label: (*label).to_owned(),
        bars: paths
            .iter()
            .enumerate()
            .map(|path| bar(path, channel))
            .collect(),
    };
    BarChart {
        title: "Error against real sensors, held-out trials".to_owned(),
        y_label: "RMSE, m/s² and rad/s".to_owned(),
        groups: channels.iter().enumerate().map(group).collect(),
        level: None,
    }
}

/// Gains, some below zero, of regimes with long names.
fn gains() -> BarChart {
    let names = [
        "virtual only, analytic",
        "virtual only, learned and mapped",
        "mixed, without the global trajectory",
        "mixed, everything",
        "<none> & more",
    ];
    let group = |(index, label): (usize, &&str)| {
        let value = 3.1 * index as f64 - 4.0;
        let interval = (index != 1).then_some((value + 1.1, value - 0.9));
        Group {
            label: (*label).to_owned(),
            bars: vec![Bar {
                series: "F1".to_owned(),
                value,
                interval,
            }],
        }
    };
    BarChart {
        title: "Gain in macro F1 over real data alone".to_owned(),
        y_label: "points of F1".to_owned(),
        groups: names.iter().enumerate().map(group).collect(),
        level: Some(Level {
            value: 6.7,
            label: "the paper's gain".to_owned(),
        }),
    }
}

/// More groups than their names have room side by side.
fn leaning() -> BarChart {
    let bar = |series: &str, value: f64| Bar {
        series: series.to_owned(),
        value,
        interval: None,
    };
    let group = |k: u32| Group {
        label: format!("walk_{k:02}_undisturbed_combination"),
        bars: vec![bar("a", 0.1 * f64::from(k)), bar("b", 0.2)],
    };
    BarChart {
        groups: (0..24).map(group).collect(),
        title: "Trials, one by one".to_owned(),
        level: None,
        ..gains()
    }
}

fn curve(lines: usize) -> LineChart {
    let line = |number: usize| {
        let point = |share: f64| {
            let y = 45.0 + 4.0 * number as f64 + 9.0 * (share / 10.0).ln();
            Point {
                x: share,
                y,
                interval: Some((y - 2.5, y + 3.0)),
            }
        };
        Line {
            label: format!("regime {number}"),
            points: [10.0, 25.0, 50.0, 100.0].map(point).to_vec(),
            is_reference: false,
        }
    };
    LineChart {
        title: "Learning curve".to_owned(),
        x_label: "share of the training people, %".to_owned(),
        y_label: "macro F1, %".to_owned(),
        logarithmic_x: false,
        logarithmic_y: false,
        lines: (0..lines).map(line).collect(),
        level: None,
    }
}

fn panel() -> Panel {
    let points = |phase: f64| {
        (0..400)
            .map(|k| (0.01 * f64::from(k), (0.05 * f64::from(k) + phase).sin()))
            .collect::<Vec<_>>()
    };
    Panel {
        title: "accelerometer x".to_owned(),
        width: 540.0,
        height: 180.0,
        x: Axis::exact(0.0, 4.0),
        y: Axis::linear([-1.0, 1.0].into_iter()),
        x_label: "time, s".to_owned(),
        y_label: "m/s²".to_owned(),
        shades: vec![("window", 1.0, 2.0)],
        level: Some(0.0),
        series: vec![
            Series {
                class: "measured",
                points: points(0.0),
            },
            Series {
                class: "after",
                points: points(0.2),
            },
        ],
    }
}

fn all() -> Vec<(&'static str, Chart)> {
    let paths = [
        "joint",
        "spline, low-pass",
        "analytic",
        "learned",
        "learned + mapping",
    ];
    let mut many = curve(10);
    many.logarithmic_x = true;
    let hundred = Line {
        label: "long".to_owned(),
        points: (0..40)
            .map(|k| Point {
                x: f64::from(k) + 0.5,
                y: 60.0,
                interval: None,
            })
            .collect(),
        is_reference: false,
    };
    many.lines.push(hundred);
    vec![
        ("bars", Chart::Bars(fidelity(&paths))),
        (
            "many",
            Chart::Bars(fidelity(&[
                "a", "b", "c", "d", "e", "f", "g", "h", "i", "k",
            ])),
        ),
        ("gains", Chart::Bars(gains())),
        ("leaning", Chart::Bars(leaning())),
        (
            "curve",
            Chart::Lines(LineChart {
                level: Some(Level {
                    value: 52.0,
                    label: "chance".to_owned(),
                }),
                ..curve(3)
            }),
        ),
        ("curves", Chart::Lines(many)),
        ("panel", Chart::Panel(panel())),
        (
            "nothing",
            Chart::Bars(BarChart {
                groups: Vec::new(),
                ..gains()
            }),
        ),
    ]
}

fn page() -> Page {
    let table = Table {
        columns: vec![
            Column::text("Path"),
            Column::numbers("RMSE, m/s²"),
            Column::numbers("gain"),
        ],
        rows: vec![
            vec!["analytic | spline".into(), "1.21".into()],
            vec!["**learned** <b>".into(), "0.92".into(), "24 %".into()],
        ],
    };
    let charts = all().into_iter().map(|(_, chart)| chart).collect();
    let folded = Block::Details(
        "All numbers".into(),
        vec![
            Block::Table(table.clone()),
            Block::List(vec!["one".into(), "two `three`".into()]),
        ],
    );
    let blocks = vec![
        Block::Text("What **came out** & why.".into()),
        Block::Table(table),
        Block::Charts(charts),
        Block::Note("How.".into()),
        folded,
    ];
    Page {
        title: "Fidelity <x>".into(),
        lead: "On held-out trials.".into(),
        sections: vec![Section {
            title: "Wrist & foot".into(),
            blocks,
        }],
    }
}

#[test]
fn pictures_are_well_formed_and_say_what_they_show() {
    for (name, chart) in all() {
        let svg = chart.svg();
        let document = roxmltree::Document::parse(&svg)
            .unwrap_or_else(|error| panic!("{name}: {error}\n{svg}"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        assert_eq!(document.root_element().attribute("role"), Some("img"));
        let of_class = |class: &str| {
            document
                .descendants()
                .filter(|node| node.attribute("class") == Some(class))
                .count()
        };
        assert_eq!(
            of_class("ticks"),
            if matches!(chart, Chart::Lines(_)) {
                2
            } else {
                1
            },
            "{name}"
        );
        assert!(of_class("title") >= 1 && of_class("label") >= 1, "{name}");
    }
}

#[test]
fn bars_stand_on_zero_as_long_as_their_values() {
    let svg = gains().svg();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let rects: Vec<_> = document
        .descendants()
        .filter(|node| node.has_tag_name("rect") && node.parent().unwrap().has_tag_name("svg"))
        .collect();
    let bars: Vec<(f64, f64)> = rects
        .iter()
        .filter(|node| node.children().any(|child| child.has_tag_name("title")))
        .map(|node| {
            (
                node.attribute("y").unwrap().parse().unwrap(),
                node.attribute("height").unwrap().parse().unwrap(),
            )
        })
        .collect();
    assert_eq!(bars.len(), 5);
    // -4, -0.9, 2.2, 5.3, 8.4: the first two hang from where the others stand.
    let zero = bars[0].0;
    assert!(
        bars[1].0 == zero
            && bars[2..]
                .iter()
                .all(|(top, tall)| (top + tall - zero).abs() < 0.11),
        "{bars:?}"
    );
    for (bar, value) in bars.iter().zip([4.0, 0.9, 2.2, 5.3, 8.4]) {
        assert!((bar.1 / value - bars[4].1 / 8.4).abs() < 0.15, "{bars:?}");
    }
    // Four intervals, given upside down.
    let whiskers: Vec<_> = document
        .descendants()
        .filter(|node| node.attribute("class") == Some("whisker"))
        .collect();
    assert_eq!(whiskers.len(), 4);
    assert!(svg.contains("&lt;none&gt; &amp; more") && svg.contains("the paper&#39;s gain"));
}

#[test]
fn series_keep_colour_and_place_where_a_group_lacks_one() {
    let mut chart = fidelity(&["one", "two", "three"]);
    let whole = chart.svg();
    chart.groups[1].bars.remove(1);
    chart.groups[2].bars[0].value = f64::NAN;
    let svg = chart.svg();
    let places = |svg: &str| -> Vec<(String, String)> {
        let document = roxmltree::Document::parse(svg).unwrap();
        let bars = document
            .descendants()
            .filter(|node| node.has_tag_name("rect") && node.has_children());
        bars.map(|node| {
            (
                node.attribute("class").unwrap().to_owned(),
                node.attribute("x").unwrap().to_owned(),
            )
        })
        .collect()
    };
    let (mut expected, found) = (places(&whole), places(&svg));
    expected.remove(6);
    expected.remove(4);
    assert_eq!(found, expected);
}

#[test]
fn lines_are_interrupted_and_marked_at_their_own_places() {
    let mut chart = curve(2);
    chart.lines[0].points[1].y = f64::NAN;
    let svg = chart.svg();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let strokes: Vec<_> = document
        .descendants()
        .filter(|node| node.attribute("class") == Some("stroke"))
        .skip(2)
        .collect();
    assert_eq!(
        strokes[0].attribute("d").unwrap().matches('M').count(),
        2,
        "interrupted once"
    );
    assert_eq!(strokes[1].attribute("d").unwrap().matches('M').count(), 1);
    for tick in ["10", "25", "50", "100"] {
        assert!(
            svg.contains(&format!("text-anchor=\"middle\">{tick}</text>")),
            "{tick}"
        );
    }
    chart.logarithmic_x = true;
    chart.lines[0].points[0].x = 0.0;
    assert!(roxmltree::Document::parse(&chart.svg()).is_ok());
}

#[test]
fn the_page_is_well_formed_and_loads_nothing() {
    let html = page().html();
    if let Some(folder) = std::env::var_os("CROMOSIM_CHARTS") {
        std::fs::write(std::path::Path::new(&folder).join("page.html"), &html).unwrap();
    }
    let (_, body) = html.split_once("<body>").unwrap();
    let body = format!("<body>{}", body.split_once("</html>").unwrap().0);
    let document = roxmltree::Document::parse(&body).unwrap();
    assert_eq!(
        document
            .descendants()
            .filter(|node| node.has_tag_name("figure"))
            .count(),
        all().len()
    );
    assert!(
        html.contains("Fidelity &lt;x&gt;")
            && html.contains("<b>learned</b> &lt;b&gt;")
            && html.contains("two <code>three</code>")
    );
    let elsewhere = html.replace("http://www.w3.org/2000/svg", "");
    assert!(
        !elsewhere.contains("http")
            && !elsewhere.contains("<script")
            && !elsewhere.contains("src=")
            && !elsewhere.contains("url(")
    );
    assert_eq!(html, page().html());
}

#[test]
fn tables_are_markdown_too() {
    let Block::Table(table) = &page().sections[0].blocks[1] else {
        unreachable!()
    };
    let expected = "| Path | RMSE, m/s² | gain |\n|---|---:|---:|\n| analytic \\| spline | 1.21 |  |\n| **learned** <b> | 0.92 | 24 % |\n";
    assert_eq!(table.markdown(), expected);
}

#[cfg(feature = "png")]
mod png {
    use super::*;

    /// Width, height and pixels (red, green, blue, alpha).
    fn decoded(bytes: &[u8]) -> (u32, u32, Vec<[u8; 4]>) {
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!(
            (info.color_type, info.bit_depth),
            (::png::ColorType::Rgba, ::png::BitDepth::Eight)
        );
        (info.width, info.height, pixels.as_chunks::<4>().0.to_vec())
    }

    #[test]
    fn pictures_have_the_asked_width_their_colours_and_the_same_bytes() {
        for (name, chart) in all() {
            let bytes = chart.png(900).unwrap();
            if let Some(folder) = std::env::var_os("CROMOSIM_CHARTS") {
                std::fs::write(
                    std::path::Path::new(&folder).join(format!("{name}.png")),
                    chart.png(1400).unwrap(),
                )
                .unwrap();
            }
            let (width, height, pixels) = decoded(&bytes);
            assert!(
                width == 900 && height > 100 && pixels.iter().all(|pixel| pixel[3] == 255),
                "{name}"
            );
            assert_eq!(pixels[0], [255; 4], "{name}: the ground is white");
            let count =
                |colour: [u8; 3]| pixels.iter().filter(|pixel| pixel[..3] == colour).count();
            let (colour, least) = match &chart {
                Chart::Bars(chart) if chart.groups.is_empty() => ([0xec, 0xee, 0xf0], 0),
                Chart::Bars(_) => ([0x00, 0x72, 0xb2], 2000),
                Chart::Lines(_) => ([0x00, 0x72, 0xb2], 100),
                Chart::Panel(_) => ([0xb4, 0xbc, 0xc7], 500),
            };
            assert!(count(colour) >= least, "{name}: {} pixels", count(colour));
            assert_eq!(bytes, chart.png(900).unwrap(), "{name}");
        }
    }

    #[test]
    fn words_are_drawn_bold_and_with_every_sign_in_use() {
        let draw = |title: &str| {
            decoded(
                &LineChart {
                    title: title.to_owned(),
                    ..curve(1)
                }
                .png(700)
                .unwrap(),
            )
            .2
        };
        assert_ne!(draw("a"), draw("b"));
        assert_ne!(draw("regime"), draw("regine"));
        // A sign that the font lacks would be drawn as the box of another one that it lacks.
        let missing = draw("\u{10FFFD}");
        for sign in "⁰¹²³⁴⁵⁶⁷⁸⁹⁻−±→·×°≤≥∞–µσΔéß%".chars() {
            assert_ne!(draw(&sign.to_string()), missing, "{sign}");
        }
        let ink = |pixels: &[[u8; 4]]| pixels.iter().filter(|pixel| pixel[0] < 128).count();
        let labelled = |title: &str, x_label: &str| {
            let chart = LineChart {
                title: title.to_owned(),
                x_label: x_label.to_owned(),
                ..curve(1)
            };
            ink(&decoded(&chart.png(1400).unwrap()).2)
        };
        let nothing = labelled("", "");
        let (as_title, as_label) = (
            labelled("Weight of letters", "") - nothing,
            labelled("", "Weight of letters") - nothing,
        );
        assert!(
            as_label > 500 && as_title as f64 > 1.4 * as_label as f64,
            "a title is bold: {as_title} and {as_label} dark pixels"
        );
    }

    #[test]
    fn absurd_sizes_and_texts_are_errors() {
        let error = curve(1).png(3).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a picture 3 pixels wide: at least 16 and at most 8192 are possible"
        );
        assert!(matches!(
            crate::png("<html", 100),
            Err(ChartsError::NotSvg { .. })
        ));
        let tall = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1 100\"/>";
        assert!(matches!(
            crate::png(tall, 1000),
            Err(ChartsError::Width { .. })
        ));
    }
}

/// sRGB to linear light.
fn linear(hex: &str) -> [f64; 3] {
    let channel = |index: usize| {
        f64::from(u8::from_str_radix(&hex[1 + 2 * index..3 + 2 * index], 16).unwrap()) / 255.0
    };
    [0, 1, 2].map(|index| {
        let value = channel(index);
        if value <= 0.04045 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055_f64).powf(2.4)
        }
    })
}

/// CIE L*a*b* of linear sRGB (D65).
fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let rows = [
        ([0.4124, 0.3576, 0.1805], 0.9505),
        ([0.2126, 0.7152, 0.0722], 1.0),
        ([0.0193, 0.1192, 0.9505], 1.089),
    ];
    let [x, y, z] = rows.map(|(row, white)| {
        let value = row
            .iter()
            .zip(rgb)
            .map(|(weight, value)| weight * value)
            .sum::<f64>()
            / white;
        if value > 0.008_856 {
            value.cbrt()
        } else {
            7.787 * value + 16.0 / 116.0
        }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

#[test]
fn colours_differ_for_colour_blind_eyes_too() {
    // Machado, Oliveira and Fernandes (2009), severity 1: as it is, protanopia, deuteranopia.
    let eyes = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [
            [0.152_286, 1.052_583, -0.204_868],
            [0.114_503, 0.786_281, 0.099_216],
            [-0.003_882, -0.048_116, 1.051_998],
        ],
        [
            [0.367_322, 0.860_646, -0.227_968],
            [0.280_085, 0.672_501, 0.047_413],
            [-0.011_820, 0.042_940, 0.968_881],
        ],
    ];
    let seen = |matrix: &[[f64; 3]; 3], rgb: [f64; 3]| {
        lab(matrix.map(|row| {
            row.iter()
                .zip(rgb)
                .map(|(weight, value)| weight * value)
                .sum::<f64>()
                .clamp(0.0, 1.0)
        }))
    };
    let themes: Vec<Vec<&str>> = style::CHARTS
        .lines()
        .filter(|line| line.contains("--c0:"))
        .map(|line| {
            line.split("--c")
                .skip(1)
                .map(|part| part.split([':', ';']).nth(1).unwrap().trim())
                .collect()
        })
        .collect();
    assert_eq!(themes.len(), 2, "light and dark");
    for theme in themes {
        assert_eq!(theme.len(), 8);
        for matrix in &eyes {
            let colours: Vec<[f64; 3]> =
                theme.iter().map(|hex| seen(matrix, linear(hex))).collect();
            for (one, other) in (0..8).flat_map(|one| (0..one).map(move |other| (one, other))) {
                let distance = colours[one]
                    .iter()
                    .zip(colours[other])
                    .map(|(a, b)| (a - b) * (a - b))
                    .sum::<f64>()
                    .sqrt();
                assert!(
                    distance > 20.0,
                    "{} and {}: {distance:.1}",
                    theme[one],
                    theme[other]
                );
            }
        }
    }
}
