"""The documentation site: `python -m docs.site` collects its pages and builds it with Zensical."""
