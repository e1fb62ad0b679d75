/* firmware/linux/kind/virtual/tool.c - a virtual axis, which no tool can ask: see
 * firmware/linux/tools/kind.h and firmware/linux/commands/drive/kind.h. */
#include "firmware/linux/commands/drive/kind.h"

/* session_who turns it away before either is used. */
const struct tool_kind tool_kind_virtual = { .number = "node" };
const struct verb_kind verb_kind_virtual = { .find = NULL };
