/* firmware/host/base/wall_time.c - see wall_time.h. */
#include "firmware/host/base/wall_time.h"

#include <stdbool.h>
#include <stddef.h>

#define WALL_TIME_NS_PER_S INT64_C(1000000000)

/* Exactly `digits` of them; -1: others are there. */
static int wall_time_digits(const char **at, unsigned digits)
{
    int value = 0;
    for (unsigned i = 0; i < digits; i++, (*at)++) {
        if (**at < '0' || **at > '9')
            return -1;
        value = 10 * value + (**at - '0');
    }
    return value;
}

static bool wall_time_mark(const char **at, char mark)
{
    if (**at != mark)
        return false;
    (*at)++;
    return true;
}

static bool wall_time_is_leap(int year)
{
    return year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
}

static int wall_time_month_days(int year, int month)
{
    static const int days[] = {
        31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31
    };
    return days[month - 1] + (month == 2 && wall_time_is_leap(year));
}

/* Before the first of January of a year; years from 1 on. */
static int64_t wall_time_days_before(int year)
{
    const int y = year - 1;
    return INT64_C(365) * y + y / 4 - y / 100 + y / 400;
}

static const char *wall_time_date(const char **at, int64_t *days)
{
    const int year = wall_time_digits(at, 4);
    const bool first = year >= 0 && wall_time_mark(at, '-');
    const int month = first ? wall_time_digits(at, 2) : -1;
    const bool second = month >= 0 && wall_time_mark(at, '-');
    const int day = second ? wall_time_digits(at, 2) : -1;
    if (day < 0)
        return "has no date";
    if (year < 1970 || year > 2261)
        return "has a year that is not from 1970 to 2261";
    if (month < 1 || month > 12)
        return "has a month that is not from 01 to 12";
    if (day < 1 || day > wall_time_month_days(year, month))
        return "has a day that the month does not have";
    *days = wall_time_days_before(year) - wall_time_days_before(1970) + day - 1;
    for (int m = 1; m < month; m++)
        *days += wall_time_month_days(year, m);
    return NULL;
}

static const char *wall_time_fraction(const char **at, int64_t *ns)
{
    int64_t unit_ns = WALL_TIME_NS_PER_S;
    *ns = 0;
    if (!wall_time_mark(at, '.'))
        return NULL;
    do {
        const int digit = wall_time_digits(at, 1);
        unit_ns /= 10;
        if (digit < 0)
            return "has no digits after the point";
        if (unit_ns == 0)
            return "has more than nine decimals";
        *ns += digit * unit_ns;
    } while (**at >= '0' && **at <= '9');
    return NULL;
}

static const char *wall_time_clock(const char **at, int64_t *t_ns)
{
    const int hour = wall_time_digits(at, 2);
    const bool first = hour >= 0 && wall_time_mark(at, ':');
    const int minute = first ? wall_time_digits(at, 2) : -1;
    const bool second = minute >= 0 && wall_time_mark(at, ':');
    const int s = second ? wall_time_digits(at, 2) : -1;
    int64_t ns;
    if (s < 0)
        return "has no time with hours, minutes and seconds";
    if (hour > 23 || minute > 59 || s > 59)
        return "has a time that no clock shows";
    const char *wrong = wall_time_fraction(at, &ns);
    *t_ns =
        (hour * INT64_C(3600) + minute * INT64_C(60) + s) * WALL_TIME_NS_PER_S +
        ns;
    return wrong;
}

static const char *wall_time_zone(const char **at, int64_t *zone_s)
{
    *zone_s = 0;
    if (wall_time_mark(at, 'Z'))
        return NULL;
    const int sign = **at == '-' ? -1 : 1;
    if (!wall_time_mark(at, '+') && !wall_time_mark(at, '-'))
        return "has no time zone";
    const int hour = wall_time_digits(at, 2);
    const bool colon = hour >= 0 && wall_time_mark(at, ':');
    const int minute = colon ? wall_time_digits(at, 2) : -1;
    if (minute < 0 || minute > 59 || hour > 23)
        return "has no time zone";
    *zone_s = sign * (hour * INT64_C(3600) + minute * INT64_C(60));
    return NULL;
}

const char *wall_time_parse(const char *text, int64_t *t_ns)
{
    int64_t days = 0, clock_ns = 0, zone_s = 0;
    const char *wrong = wall_time_date(&text, &days);
    if (wrong == NULL && !wall_time_mark(&text, 'T') &&
        !wall_time_mark(&text, ' '))
        wrong = "has no time after its date";
    if (wrong == NULL)
        wrong = wall_time_clock(&text, &clock_ns);
    if (wrong == NULL)
        wrong = wall_time_zone(&text, &zone_s);
    if (wrong == NULL && *text != 0)
        wrong = "has something after its time zone";
    if (wrong == NULL)
        *t_ns = (days * 86400 - zone_s) * WALL_TIME_NS_PER_S + clock_ns;
    return wrong;
}
