"""Raw data of recordings over the years: retention by rule, archive, restoration, holds, and the size of it all."""
