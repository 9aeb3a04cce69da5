"""The flat model of the front end as frozen dataclasses."""
