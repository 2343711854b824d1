//! Which topics are which placement: what users say where a robot's topics have names of their own.

use std::collections::BTreeMap;
use std::fmt::{self, Display};

use cromosim_bag::BagReader;
use cromosim_imu::Placement;
use cromosim_msgs::RosMessage;
use cromosim_msgs::sensor_msgs::Imu;

use crate::RecordingError;

/// Parts of topics' names that say what a topic is, not whose it is.
const GENERIC: [&str; 12] = [
    "data",
    "data_raw",
    "filtered",
    "imu",
    "odom",
    "odometry",
    "pose",
    "raw",
    "tf",
    "tf_static",
    "transform",
    "rigid_bodies",
];

/// Where poses are: `TOPIC[:BODY[@FIXED]]`.
///
/// Neither `:` nor `@` can stand in the name of a topic, and no shell reads them otherwise (it would
/// `>`, say).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PoseSource {
    /// A topic of poses.
    pub topic: String,
    /// Which of several bodies on that topic: a frame of TF, a child frame, a rigid body's name.
    pub body: Option<String>,
    /// Of TF: the frame that stands still; the root of the tree where absent.
    pub fixed: Option<String>,
}

impl PoseSource {
    /// The topic alone.
    pub fn topic(topic: &str) -> Self {
        Self {
            topic: topic.to_owned(),
            ..Self::default()
        }
    }

    /// Reads `TOPIC[:BODY[@FIXED]]`.
    pub fn parse(text: &str) -> Self {
        let (topic, rest) = split(text, ':');
        let (body, fixed) = rest.map_or((None, None), |rest| {
            let (body, fixed) = split(rest, '@');
            (Some(body), fixed)
        });
        let owned = |part: Option<&str>| part.filter(|it| !it.is_empty()).map(str::to_owned);
        Self {
            topic: topic.to_owned(),
            body: owned(body),
            fixed: owned(fixed),
        }
    }

    /// The last part of the body's name, or that of the topic which says whose it is.
    fn own_name(&self) -> String {
        match &self.body {
            Some(body) => body.rsplit('/').next().unwrap_or_default().to_owned(),
            None => name_of_topic(&self.topic),
        }
    }
}

impl Display for PoseSource {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.topic)?;
        if let Some(body) = &self.body {
            write!(out, ":{body}")?;
        }
        self.fixed
            .as_ref()
            .map_or(Ok(()), |fixed| write!(out, "@{fixed}"))
    }
}

/// Which topics hold the references and the IMUs of which placement. What it does not name is where
/// it always is: `/reference/NAME` where no reference is named, `/imu/NAME/data_raw` for IMUs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicMap {
    /// By placement; where there are any, they are all that there are.
    pub references: BTreeMap<String, PoseSource>,
    /// Topics of Imu by placement.
    pub imus: BTreeMap<String, String>,
}

impl TopicMap {
    /// Reads `[NAME=]TOPIC[:BODY[@FIXED]]` for references and `[NAME=]TOPIC` for IMUs. Without NAME a
    /// placement is called after the body, or the part of the topic that says whose it is (`odom` of
    /// `/odom`, `camera` of `/camera/imu`, `wrist` of `/imu/wrist/data`); one reference and one IMU
    /// belong together, under the name that either was given, else the reference's.
    ///
    /// # Errors
    /// [`RecordingError::PlacementName`] for a name that cannot be part of a topic, or is there twice.
    pub fn parse(references: &[String], imus: &[String]) -> Result<Self, RecordingError> {
        let references = references.iter().map(|text| split_name(text));
        let references = references.map(|(name, rest)| (name, PoseSource::parse(rest)));
        let references: Vec<(Option<&str>, PoseSource)> = references.collect();
        let imus: Vec<(Option<&str>, &str)> = imus.iter().map(|text| split_name(text)).collect();
        let shared = match (references.as_slice(), imus.as_slice()) {
            ([(name, source)], [(other, _)]) => {
                let given = name.or(*other).map(str::to_owned);
                let both_differ = name.is_some() && other.is_some();
                (!both_differ).then(|| given.unwrap_or_else(|| source.own_name()))
            }
            _ => None,
        };
        let mut map = Self::default();
        for (name, source) in references {
            let name = name.map(str::to_owned).or_else(|| shared.clone());
            let name = name.unwrap_or_else(|| source.own_name());
            add(&mut map.references, "--reference-topic", name, source)?;
        }
        for (name, topic) in imus {
            let name = name.map(str::to_owned).or_else(|| shared.clone());
            let name = name.unwrap_or_else(|| name_of_topic(topic));
            add(&mut map.imus, "--imu-topic", name, topic.to_owned())?;
        }
        Ok(map)
    }

    /// Whether it names nothing.
    pub fn is_empty(&self) -> bool {
        self.references.is_empty() && self.imus.is_empty()
    }

    /// The topic of a placement's IMU, whether the bag has it or not.
    pub fn imu_topic(&self, placement: &str) -> String {
        let named = self.imus.get(placement).cloned();
        named.unwrap_or_else(|| format!("/imu/{placement}/data_raw"))
    }
}

/// Refuses a topic that the bag does not have, or that holds no Imu.
///
/// # Errors
/// With the topics that there are, or with its type.
pub(crate) fn check_imu_topic(reader: &BagReader, topic: &str) -> Result<(), RecordingError> {
    let found = &reader.topic(topic)?.type_name;
    if found == Imu::TYPE_NAME {
        return Ok(());
    }
    Err(RecordingError::Unsuitable {
        path: format!("{}, {topic}", reader.path().display()).into(),
        problem: format!(
            "a topic of {found}; --imu-topic takes {}{}",
            Imu::TYPE_NAME,
            other_topics(reader, &[Imu::TYPE_NAME])
        ),
    })
}

/// The topics of these types, for the end of an error.
pub(crate) fn other_topics(reader: &BagReader, types: &[&str]) -> String {
    let topics = reader.summary().topics.iter().map(|counted| &counted.topic);
    let suiting = topics.filter(|topic| types.contains(&topic.type_name.as_str()));
    let names: Vec<&str> = suiting.map(|topic| topic.name.as_str()).collect();
    if names.is_empty() {
        "; the bag has none".to_owned()
    } else {
        format!("; the bag has {}", names.join(", "))
    }
}

fn add<V>(
    to: &mut BTreeMap<String, V>,
    option: &'static str,
    name: String,
    value: V,
) -> Result<(), RecordingError> {
    let refuse = |problem: String| RecordingError::PlacementName {
        option,
        name: name.clone(),
        problem,
    };
    if let Err((_, problem)) = Placement::at_site(&name, "left_watch", 1.0) {
        return Err(refuse(format!("{problem}; give NAME=TOPIC")));
    }
    if to.contains_key(&name) {
        return Err(refuse(
            "two topics would be this placement; give each a name, NAME=TOPIC".to_owned(),
        ));
    }
    to.insert(name, value);
    Ok(())
}

fn split_name(text: &str) -> (Option<&str>, &str) {
    match text.split_once('=') {
        // Behind the topic's end it is part of a body's name.
        Some((name, rest)) if !name.contains(':') => (Some(name), rest),
        _ => (None, text),
    }
}

fn split(text: &str, at: char) -> (&str, Option<&str>) {
    text.split_once(at)
        .map_or((text, None), |(before, after)| (before, Some(after)))
}

fn name_of_topic(topic: &str) -> String {
    let mut parts = topic.rsplit('/').filter(|part| !part.is_empty());
    let own = parts.clone().find(|part| !GENERIC.contains(part));
    // Of nothing but generic parts the first says most: `imu` of /imu/data.
    own.or(parts.next_back()).unwrap_or_default().to_owned()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn map(references: &[&str], imus: &[&str]) -> Result<TopicMap, String> {
        let owned = |texts: &[&str]| texts.iter().map(|it| (*it).to_owned()).collect::<Vec<_>>();
        TopicMap::parse(&owned(references), &owned(imus)).map_err(|error| error.to_string())
    }

    #[test]
    fn names_come_from_the_user_the_body_or_the_topic() {
        let found = map(
            &[
                "gripper=/tf:tool0@map",
                "/mocap/rigid_bodies:watch",
                "/vrpn/helmet/pose",
            ],
            &["/imu/wrist/data", "/camera/imu", "base=/imu/data"],
        )
        .unwrap();
        let source = &found.references["gripper"];
        assert_eq!(source, &PoseSource::parse("/tf:tool0@map"));
        assert_eq!(
            (source.body.as_deref(), source.fixed.as_deref()),
            (Some("tool0"), Some("map"))
        );
        assert_eq!(source.to_string(), "/tf:tool0@map");
        let names: Vec<&String> = found.references.keys().collect();
        assert_eq!(names, ["gripper", "helmet", "watch"]);
        let names: Vec<&String> = found.imus.keys().collect();
        assert_eq!(names, ["base", "camera", "wrist"]);
        assert_eq!(found.imu_topic("base"), "/imu/data");
        assert_eq!(found.imu_topic("gripper"), "/imu/gripper/data_raw");
    }

    #[test]
    fn one_reference_and_one_imu_belong_together() {
        for (reference, imu, name) in [
            ("/odom", "/imu/data", "odom"),
            ("base=/odom", "/imu/data", "base"),
            ("/odom", "base=/imu/data", "base"),
        ] {
            let found = map(&[reference], &[imu]).unwrap();
            assert_eq!(
                found.imus.keys().collect::<Vec<_>>(),
                [name],
                "{reference} {imu}"
            );
            assert_eq!(found.references.keys().collect::<Vec<_>>(), [name]);
        }
        let found = map(&["a=/odom"], &["b=/imu/data"]).unwrap();
        assert_eq!(found.imus.keys().collect::<Vec<_>>(), ["b"]);
    }

    #[test]
    fn names_that_are_no_part_of_a_topic_or_come_twice_are_refused() {
        let said = map(&["/mocap/rigid_bodies:Rigid Body 1"], &[]).unwrap_err();
        assert!(
            said.contains("Rigid Body 1") && said.contains("NAME=TOPIC"),
            "{said}"
        );
        let said = map(&[], &["/imu/data", "/imu/data_raw"]).unwrap_err();
        assert!(
            said.contains("--imu-topic imu") && said.contains("two topics"),
            "{said}"
        );
    }
}
