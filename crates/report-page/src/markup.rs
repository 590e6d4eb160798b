//! Text that goes into a page: escaped, and numbers as people read them.

use std::fmt::{self, Display, Write};

/// Text from elsewhere (names of files, warnings): nothing in it is markup, neither between tags nor in a quoted attribute.
pub(crate) struct Text<'a>(pub &'a str);

impl Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.0.chars() {
            match c {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                // Browsers drop these or take them for something else.
                c if c.is_control() && !matches!(c, '\n' | '\t') => f.write_char('\u{fffd}')?,
                c => f.write_char(c)?,
            }
        }
        Ok(())
    }
}

/// A number to four digits.
pub(crate) fn figure(x: f64) -> String {
    if !x.is_finite() {
        return "unknown".into();
    }
    let exponent = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    let trimmed = |text: &str| text.trim_end_matches('0').trim_end_matches('.').to_owned();
    if !(-4..6).contains(&exponent) {
        let text = format!("{x:.3e}");
        return text.split_once('e').map_or(text.clone(), |(digits, power)| format!("{}e{power}", trimmed(digits)));
    }
    let decimals = (3 - exponent).max(0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { trimmed(&text) } else { text }
}

/// A whole number, its digits in threes.
pub(crate) fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            // A narrow space that does not break.
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A count of things: `1 component`, `2 components`.
pub(crate) fn counted(n: usize, thing: &str) -> String {
    format!("{} {thing}{}", count(n), if n == 1 { "" } else { "s" })
}

pub(crate) fn percent(share: f64) -> String {
    match 100.0 * share {
        p if !p.is_finite() => "unknown".into(),
        0.0 => "none".into(),
        p if p < 0.01 => "below 0.01 %".into(),
        p if p < 1.0 => format!("{p:.2} %"),
        p => format!("{p:.1} %"),
    }
}

pub(crate) fn seconds(s: f64) -> String {
    match s {
        s if s >= 120.0 => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), (s % 60.0).floor()),
        s if s >= 9.95 => format!("{s:.0} s"),
        s if s >= 0.0095 => format!("{s:.2} s"),
        _ => "≤ 0.01 s".into(),
    }
}

pub(crate) fn bytes(n: u64) -> String {
    let mebibytes = n as f64 / f64::from(1 << 20);
    if mebibytes >= 1024.0 { format!("{:.1} GiB", mebibytes / 1024.0) } else { format!("{mebibytes:.0} MiB") }
}

/// Several numbers along the axes.
pub(crate) fn along<T: Display>(numbers: impl IntoIterator<Item = T>) -> String {
    numbers.into_iter().map(|n| n.to_string()).collect::<Vec<_>>().join(" × ")
}

/// A table of facts: what, and what it is, and what that means. The last two are markup already.
pub(crate) fn facts(caption: &str, rows: &[(&str, String, &str)]) -> String {
    let mut html = format!("<table class=\"facts\"><caption>{}</caption><tbody>\n", Text(caption));
    for (name, value, meaning) in rows {
        let _ = writeln!(html, "<tr><th scope=\"row\">{}</th><td>{value}</td><td>{meaning}</td></tr>", Text(name));
    }
    html.push_str("</tbody></table>\n");
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_in_a_text_is_markup() {
        let text = Text("<script>alert('a' & \"b\")</script>\u{0}\u{1b}[31m").to_string();
        assert_eq!(text, "&lt;script&gt;alert(&#39;a&#39; &amp; &quot;b&quot;)&lt;/script&gt;\u{fffd}\u{fffd}[31m");
    }

    #[test]
    fn numbers_are_short() {
        let figures = [0.0, 0.199_490_4, 2.198_678, 12.0, 1234.56, 123_456.0, 1.5e9, 0.000_186_9, 0.000_018_69, -3.25]
            .map(figure)
            .join(" ");
        assert_eq!(figures, "0 0.1995 2.199 12 1235 123456 1.5e9 0.0001869 1.869e-5 -3.25");
        assert_eq!(figure(f64::NAN), "unknown");
        assert_eq!([1, 999, 1000, 1_234_567].map(count).join(" "), "1 999 1\u{202f}000 1\u{202f}234\u{202f}567");
        assert_eq!(
            [0.0, 0.003, 0.25, 59.0, 125.0].map(seconds).join(", "),
            "≤ 0.01 s, ≤ 0.01 s, 0.25 s, 59 s, 2 min 05 s"
        );
        assert_eq!([0.0, 0.000_01, 0.0014, 0.5].map(percent).join(", "), "none, below 0.01 %, 0.14 %, 50.0 %");
    }
}
