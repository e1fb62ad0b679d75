/* firmware/linux/base/json_print.c - see json_print.h. */
#include "firmware/linux/base/json_print.h"

#include "firmware/host/base/memory.h"

static bool json_printed;

bool json_is_printed(void)
{
    return json_printed;
}

static void json_put(cJSON *item, FILE *file, bool indented)
{
    char *text = indented ? cJSON_Print(item) : cJSON_PrintUnformatted(item);
    cJSON_Delete(item);
    if (text == NULL)
        memory_fail();
    fputs(text, file);
    json_printed |= file == stdout;
    cJSON_free(text);
}

void json_print(cJSON *item, FILE *file)
{
    json_put(item, file, true);
    fputc('\n', file);
}

void json_report_to(cJSON *report, bool ok, FILE *file)
{
    cJSON *const first = cJSON_AddBoolToObject(report, "ok", ok);

    cJSON_InsertItemInArray(report, 0,
                            cJSON_DetachItemViaPointer(report, first));
    json_print(report, file);
}

void json_report(cJSON *report, bool ok)
{
    json_report_to(report, ok, stdout);
}

void json_print_line(cJSON *item, FILE *file)
{
    json_put(item, file, false);
}
