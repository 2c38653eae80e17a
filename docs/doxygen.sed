# Our comments as Doxygen wants them: what a file is about stands before its first declaration; the C
# header has /* */ above or behind what it describes, and lines of dashes between its parts.
1s,^/\* ,/** @file\n,
1s,^// (.*),/// @file\n/// \1,
2,/^#pragma/s,^// ,/// ,
s,^(//.*)&([a-z]+;),\1\&amp;\2,
s,^( *)/\* ([^-]),\1/** \2,
s,([^ ]) +/\* ([^-]),\1 /**< \2,
