//! Text that others wrote, as it is shown: names in scenes and files may hold anything.

use std::borrow::Cow;

/// Longest line of a message, in characters, and how much of its end is kept: the remedy stands there. A screen has some 4000.
const LONGEST_LINE: usize = 4000;
const LONGEST_END: usize = 1000;
/// Most lines of a message.
const MOST_LINES: usize = 200;

/// Whether a character steers a terminal, turns or breaks a line, is invisible, or has no place in XML: all that are no line feed or tab. Those that join
/// letters stay.
fn steers(character: char) -> bool {
    let is_invisible = matches!(
        character,
        '\u{61c}' | '\u{200b}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}'
            | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{fffe}' | '\u{ffff}' | '\u{e0000}'..='\u{e007f}'
    );
    is_invisible || character.is_control() && !matches!(character, '\n' | '\t')
}

/// `text` with U+FFFD in place of characters that steer.
#[must_use]
pub fn shown(text: &str) -> Cow<'_, str> {
    if text.contains(steers) { text.replace(steers, "\u{fffd}").into() } else { text.into() }
}

/// A message about what others wrote: [`shown`], without the middle of long lines and the end of many.
#[must_use]
pub fn message(text: &str) -> String {
    let lines = text.split('\n').map(|line| {
        let place = |character: usize| line.char_indices().nth(character).map_or(line.len(), |(at, _)| at);
        let count = if line.len() > LONGEST_LINE { line.chars().count() } else { 0 };
        if count <= LONGEST_LINE {
            return shown(line);
        }
        let [begin, end] = [LONGEST_LINE - LONGEST_END, count - LONGEST_END].map(place);
        format!("{} [… {} characters …] {}", shown(&line[..begin]), count - LONGEST_LINE, shown(&line[end..]))
            .into()
    });
    let mut kept: Vec<Cow<'_, str>> = lines.take(MOST_LINES).collect();
    if let Some(more) = text.split('\n').count().checked_sub(MOST_LINES).filter(|more| *more > 0) {
        kept.push(format!("… and {more} more lines").into());
    }
    kept.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_is_replaced_and_what_is_written_stays() {
        for steering in
            "\u{1b}\u{9b}\r\0\u{7f}\u{200f}\u{2028}\u{202e}\u{2066}\u{feff}\u{ffff}\u{e0041}".chars()
        {
            assert_eq!(shown(&format!("a{steering}b")), "a\u{fffd}b", "{:x}", u32::from(steering));
        }
        for text in ["α ± 3", "line\n\ttab", "क्\u{200d}ष", "שלום", "👩\u{200d}🚀", "�"] {
            assert_eq!(shown(text), text);
        }
    }

    #[test]
    fn messages_keep_their_begin_and_end() {
        let short = "error: a\nerror: b\n";
        assert_eq!(message(short), short);
        let long = message(&format!("error: x:1: \"{}\" is wrong: write 1", "ö".repeat(20_000_000)));
        assert!(long.starts_with("error: x:1: \"öö") && long.ends_with("öö\" is wrong: write 1"));
        assert!(long.len() < 2 * LONGEST_LINE + 40, "{}", long.len());
        let many = message(&"x\n".repeat(1000));
        assert!(many.lines().count() == MOST_LINES + 1 && many.ends_with("and 801 more lines"), "{many}");
    }
}
